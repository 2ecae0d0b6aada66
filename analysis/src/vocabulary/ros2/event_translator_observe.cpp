// What other events tell it: of streams and losses, and this project's own of their processes.
#include "base/prefetch.hpp"
#include "event_translator.hpp"
#include "model/stream_ends.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

namespace cie::analysis {

void EventTranslator::observe(std::span<Event> events, EventBatch& batch) {
  constexpr auto kTold = kinds<StreamBegin, StreamEnd, PacketBegin, PacketEnd, RunBegin, ThreadInit,
                               CallbackInit, PublisherInit, Discarded, DamagedPacket>();
  const bool may_tell =
      may_have_copies_ || is_ros2_told_ || links_.has_any() || own_publisher_count_ > 0;
  if (!may_tell && (batch.kinds_kept() & kTold) == 0) {
    if ((batch.kinds_kept() & kinds<CallbackStart>()) == 0) return;
    for (const auto& event : events) {
      if (std::holds_alternative<CallbackStart>(event.body)) note_own(event.head);
    }
    return;
  }
  auto heeded = kTold | kinds<RunEnd, Publish, CallbackStart>();
  if (is_ros2_told_) heeded |= kinds<CallbackEnd>();
  constexpr std::size_t kInCache = 512;  // publishers; of fewer, and of ROS 2's, hints gain nothing
  constexpr std::size_t kFar = 8;
  constexpr std::size_t kNear = 4;
  const auto hinted = own_publisher_count_ > kInCache ? events.size() : 0;
  for (std::size_t i = 0; i < events.size(); ++i) {
    if (i + kFar < hinted) prefetch(events[i + kFar]);
    if (i + kNear < hinted) prefetch_next(events[i + kNear]);
    auto& event = events[i];
    if (may_have_copies_ && leave_copy(event)) continue;
    if ((heeded >> event.body.index() & 1) == 0) continue;  // most of them
    const auto& head = event.head;
    std::visit(
        Overloaded{
            [&](const StreamBegin& e) {
              apply(head, e);
              session_gaps_.apply(head, e);
            },
            [&](const StreamEnd& e) {
              end_stream(head);
              session_gaps_.apply(head, e);
            },
            [&](const PacketBegin&) {
              begin_stream(head);
              end_gap(event, batch);
            },
            [&](const PacketEnd& e) { session_gaps_.apply(head, e); },
            [&](const RunBegin&) { note_own(head); },
            [&](const ThreadInit& e) {
              note_own(head);
              apply(head, e);
            },
            [&](const RunEnd&) { tell_beside_own(event, batch); },
            [&](const CallbackInit& e) {
              note_own(head);
              apply(head, e);
            },
            [&](const PublisherInit& e) { apply(head, e); },
            [&](const Publish& e) { apply(head, e); },
            [&](CallbackStart& e) {
              note_own(head);
              complete(event, e, batch);
              pass_own(event, e, batch);
            },
            [&](const CallbackEnd& e) { pass_own(event, e, batch); },
            [&](const Discarded& e) {
              const auto from = e.last_with_room ? *e.last_with_room + Duration{1} : head.time;
              lose(head, from, e.end);
            },
            [&](const DamagedPacket& e) { lose(head, head.time, e.end.value_or(head.time)); },
            [](const auto&) {}},
        event.body);
  }
}

bool EventTranslator::leave_copy(Event& event) {
  const auto& head = event.head;
  if (head.is_derived || !head.pid || !head.tid) return false;
  const auto& stream = stream_of(head);
  auto& host = *stream.host;
  if (!host.has_several_traces) return false;
  const auto digest = ros2::digest_of(event.body);
  if (!digest) return false;
  auto& last = emitting_thread(host, head).thread->last_recorded;
  if (!last.is_copy(stream.trace, *digest)) return false;
  event.body.emplace<OtherEvent>();
  return true;
}

void EventTranslator::apply(const EventHead& head, const StreamBegin& event) {
  // Machines may be called alike: then their boots tell them apart.
  auto host = std::string(event.host) + '\0' + std::string(event.clock_uuid);
  auto& of_host = host_of(std::move(host));
  stream_of(head) = {.host = &of_host,
                     .offset_ns = event.clock_offset_ns,
                     .trace = event.trace,
                     .channel = event.channel,
                     .is_kernel = event.domain == Domain::kernel,
                     .bounds_window = event.domain == Domain::user && !event.is_left_out &&
                                      event.has_events.value_or(false),
                     .has_callback_events = event.has_callback_events.value_or(true)};
  if (event.domain != Domain::user) return;
  auto& ends_apart = channel_of(head).ends_apart;
  if (!ends_apart)
    ends_apart = ends_with_last_packet(recordings_, event.writer, std::string(event.path));
  if (!of_host.trace) ++speaking_hosts_;
  if (of_host.trace.value_or(event.trace) != event.trace) {
    of_host.has_several_traces = true;
    may_have_copies_ = true;
  }
  of_host.trace = event.trace;
}

// Whichever of its events was not lost.
void EventTranslator::note_own(const EventHead& head) {
  if (!head.pid || head.is_derived) return;
  auto* const host = stream_of(head).host;
  const auto pid = *head.pid;
  auto& noted = own_[static_cast<std::size_t>(pid) % own_.size()];
  if (noted.first == host && noted.second == pid) return;
  host->processes[pid].has_own_events = true;
  noted = {host, pid};
}

// What this project's executors do by threads of their own is called so, and no user's callback.
void EventTranslator::apply(const EventHead& head, const ThreadInit& event) {
  if (!head.pid || head.is_derived) return;
  auto& thread = stream_of(head).host->processes[*head.pid].threads[event.tid];
  thread.is_of_executor = event.role == ThreadRole::worker && event.name.starts_with("cie-");
}

void EventTranslator::apply(const EventHead& head, const CallbackInit& event) {
  if (!head.pid || head.is_derived) return;
  auto& process = stream_of(head).host->processes[*head.pid];
  process.own_ids.emplace(event.logical_id);
  if (event.kind != CallbackKind::subscription) return;
  process.own_subscriptions[event.callback].topic = event.source;
}

void EventTranslator::apply(const EventHead& head, const PublisherInit& event) {
  if (!head.pid) return;
  auto& process = stream_of(head).host->processes[*head.pid];
  process.own_topics.emplace(event.topic);
  auto& publisher = process.own_publishers[event.publisher];
  if (publisher.gid == event.writer_gid && publisher.topic == event.topic) return;  // told again
  if (publisher.messages != nullptr) ros2::pass_on(std::array{&publisher}, *publisher.messages);
  publisher = {};
  publisher.gid = event.writer_gid;
  publisher.topic = event.topic;
  constexpr std::size_t kMostKnown = std::size_t{1} << 16U;
  ++own_publisher_count_;
  if (2 * own_publisher_count_ > own_publishers_.size() && own_publishers_.size() < kMostKnown)
    own_publishers_.assign(2 * own_publishers_.size(), {});
}

void EventTranslator::prefetch(const Event& event) noexcept {
  const auto* publication = std::get_if<Publish>(&event.body);
  if (publication == nullptr || !event.head.pid) return;
  prefetch_to_write(&known_publisher(event.head, publication->publisher));
}

void EventTranslator::prefetch_next(const Event& event) noexcept {
  const auto* publication = std::get_if<Publish>(&event.body);
  if (publication == nullptr || !event.head.pid) return;
  const auto* publisher = known_publisher(event.head, publication->publisher).publisher;
  if (publisher != nullptr) prefetch_lines(publisher, &publisher->gid);
}

void EventTranslator::link_messages() {
  if (std::exchange(are_messages_linked_, true)) return;
  std::map<ros2::MessageTopic*, std::vector<ros2::OwnPublisher*>> by_topic;
  for (auto& [name, host] : hosts_) {
    for (auto& [pid, process] : host.processes) {
      for (auto& [id, publisher] : process.own_publishers) {
        if (publisher.messages != nullptr) by_topic[publisher.messages].push_back(&publisher);
      }
    }
  }
  for (const auto& [topic, publishers] : by_topic)
    ros2::pass_on(publishers, *topic);
}

void EventTranslator::apply(const EventHead& head, const Publish& event) {
  if (!head.pid || head.is_derived) return;
  const auto& stream = stream_of(head);
  auto& known = known_publisher(head, event.publisher);
  const bool is_it =
      known.host == stream.host && known.pid == *head.pid && known.id == event.publisher;
  if (!is_it) {
    auto& publishers = stream.host->processes[*head.pid].own_publishers;
    const auto found = publishers.find(event.publisher);
    if (found == publishers.end()) return;
    known = {
        .host = stream.host, .pid = *head.pid, .id = event.publisher, .publisher = &found->second};
  }
  auto& publisher = *known.publisher;
  if (publisher.messages == nullptr) {
    publisher.messages = &links_.topic(publisher.topic);
    publisher.messages->add_publisher(publisher.gid);
  }
  publisher.messages->tell_in(stream.channel, publisher.told_in);
  const auto stamp = event.source_timestamp_realtime_ns;
  if (are_messages_linked_) {
    publisher.messages->add({.gid = publisher.gid, .stamp = stamp, .is_exact = true});
  } else {
    publisher.keep(stamp);
  }
}

namespace {

// What it is called where this project's events do not tell of it.
std::string_view id_of(ros2::Callback& callback, ros2::Directory& directory) {
  if (callback.id_beside_own.empty()) {
    directory.find_node(callback);
    callback.id_beside_own = directory.logical_id(callback);
  }
  return callback.id_beside_own;
}

// Parameter services, /parameter_events and /clock: what rclcpp serves for itself is none of the user's
// callbacks, and on a thread beside those of them where cie_rclcpp has its node.
bool is_rclcpps_own(const ros2::Callback& callback) {
  constexpr std::array<std::string_view, 7> kServices{
      "/describe_parameters",      "/get_parameter_types", "/get_parameters",
      "/get_type_description",     "/list_parameters",     "/set_parameters",
      "/set_parameters_atomically"};
  if (callback.kind == CallbackKind::service) {
    return std::ranges::any_of(kServices, [&callback](std::string_view service) {
      return callback.source.ends_with(service);
    });
  }
  return callback.kind == CallbackKind::subscription &&
         (callback.source == "/parameter_events" || callback.source == "/clock");
}

}  // namespace

void EventTranslator::tell_beside_own(const Event& run_end, EventBatch& batch) {
  const auto& head = run_end.head;
  if (!head.pid || !is_ros2_told_) return;
  auto& process = stream_of(head).host->processes[*head.pid];
  for (auto& callback : process.directory.callbacks()) {
    if (!callback.kind) continue;
    const auto id = id_of(callback, process.directory);
    if (process.own_ids.contains(id)) continue;
    batch.derive(&run_end, head, ForeignCallback{.logical_id = id});
  }
}

template <typename Edge>
void EventTranslator::pass_own(const Event& whole, const Edge& edge, EventBatch& batch) {
  const auto& head = whole.head;
  if (!is_ros2_told_ || head.is_derived || !head.pid || !head.tid) return;
  const auto& emitting = emitting_thread(*stream_of(head).host, head);
  auto& runs = emitting.thread->beside_own;
  std::optional<ros2::ToldRun> other;
  if constexpr (std::is_same_v<Edge, CallbackStart>) {
    other = runs.start(edge.callback, edge.seq);
  } else {
    other = runs.end(edge.callback, edge.seq);
  }
  if (!other) return;
  const auto id = id_of(*other->callback, emitting.process->directory);
  if (emitting.process->own_ids.contains(id)) return;
  batch.derive(&whole, head,
               ForeignCallback{.logical_id = id, .ran = other->time, .stream = other->stream});
}

bool EventTranslator::is_of_other_executor(const Payload& start, const ros2::Context& context) {
  const auto& head = context.head;
  auto& directory = context.process.directory;
  auto& callback = directory.callback(start.number<ros2::Address>(0), head.time);
  auto& thread = context.thread;
  auto& runs = thread.beside_own;
  if (runs.run() || thread.is_of_executor || is_rclcpps_own(callback)) return false;
  const auto id = id_of(callback, directory);
  if (context.process.own_ids.contains(id)) return false;
  if (callback.kind) {
    runs.pass_other();
    return true;
  }
  runs.leave(callback, head);  // what it is nothing says
  if (runs.is_of_others()) {
    emit(head, ForeignCallback{.logical_id = id, .ran = head.time, .stream = head.stream},
         context.sink);
  }
  return false;
}

void EventTranslator::complete(const Event& whole, CallbackStart& event, EventBatch& batch) {
  const auto& head = whole.head;
  if (!head.pid || event.writer_gid != 0) return;
  const bool is_in_process = event.source_timestamp_realtime_ns == 0;
  if (is_in_process && !is_ros2_told_) return;
  const auto& stream = stream_of(head);
  auto& host = *stream.host;
  if (is_ros2_told_ && head.tid) {
    const auto& emitting = emitting_thread(host, head);
    if (head.time >= host.next_look) look_at_losses(host, head, emitting);
    complete_in_process(emitting, event);
  }
  if (is_in_process) return;
  link_messages();
  const auto& process = host.processes[*head.pid];
  const auto found = process.own_subscriptions.find(event.callback);
  if (found == process.own_subscriptions.end()) return;
  const auto& topic = found->second.topic;
  const auto realtime = detail::wrapping_add(head.time.ns, stream.offset_ns);
  const auto origin = links_.find(topic, event.source_timestamp_realtime_ns,
                                  take_at(realtime, host.realtime_ahead));
  event.writer_gid = origin.gid;
  event.is_writer_undecided = origin.is_undecided;
  event.source_timestamp_realtime_ns = origin.stamp;
  if (origin.shows_unseen_writer) batch.derive(&whole, head, UntracedWriter{.topic = topic});
}

// cie_rclcpp takes a message from its buffer right before it tells of the instance, which has no
// source timestamp then.
void EventTranslator::complete_in_process(const EmittingThread& emitting, CallbackStart& event) {
  const auto queued = emitting.thread->dequeued.give(nullptr);
  if (event.source_timestamp_realtime_ns != 0) return;
  auto& subscriptions = emitting.process->own_subscriptions;
  const auto found = subscriptions.find(event.callback);
  if (found == subscriptions.end()) return;
  auto& [topic, is_queue_told] = found->second;
  if (!queued || !queued->release) {
    event.is_writer_undecided = is_queue_told;  // what told of its message before was lost
    return;
  }
  is_queue_told = true;
  const auto origin = queued->message.origin_on(topic);
  event.writer_gid = origin.gid;
  event.is_writer_undecided = origin.is_undecided;
  event.source_timestamp_realtime_ns = origin.stamp;
}

}  // namespace cie::analysis
