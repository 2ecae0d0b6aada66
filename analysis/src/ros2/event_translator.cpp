#include "event_translator.hpp"

#include <cie/tracepoints/ros2_profile.hpp>

#include <algorithm>
#include <iterator>

namespace cie::analysis {

using ros2::Address;
using ros2::CallbackNumber;
using ros2::MessageLinks;
using ros2::Publication;
using ros2::Ros2Event;

namespace {

constexpr std::size_t kMaxOpen = 64;
constexpr std::size_t kMaxHandedOver = 4096;
// "ros2", then a number: what other writers have are ids drawn by DDS.
constexpr std::uint64_t kGid = 0x726f'7332'0000'0000U;

void emit(const EventHead& head, EventBody body, const EventTranslator::Sink& sink) {
  Event event{.head = head, .body = body};
  event.head.is_derived = true;
  sink(event);
}

}  // namespace

void EventTranslator::apply(const EventHead& head, const StreamBegin& event) {
  const auto index = static_cast<std::size_t>(head.stream);
  if (index >= streams_.size()) streams_.resize(index + 1);
  streams_[index] = Stream{.host = std::string(event.host), .offset_ns = event.clock_offset_ns};
}

void EventTranslator::apply(const EventHead& head, const RunBegin& /*event*/) {
  if (!head.pid) return;
  hosts_[stream_of(head).host].processes[*head.pid].has_own_events = true;
}

// Whether the profile `ros2` says here what an event of this project's own says, too. Both are
// announced together; what runs unannounced before is left to the own ones if it can be theirs.
bool EventTranslator::is_told_better(Ros2Event event, const Payload& p, Process& process) {
  switch (event) {
    case Ros2Event::rmw_take:
    case Ros2Event::executor_wait:
    case Ros2Event::executor_ready:
      return process.has_ros2_profile && process.has_own_events;  // they name nobody
    default:
      break;
  }
  const auto handle = p.number<Address>(0);
  if (!is_ros2_profile_handle(handle)) return false;
  process.has_ros2_profile = true;
  if (process.has_own_events) return true;
  switch (event) {
    case Ros2Event::callback_start:
    case Ros2Event::callback_end:
      return !process.directory.has_callback(handle);
    case Ros2Event::rcl_publish:
      return !process.directory.has_publisher(handle);
    default:
      return false;
  }
}

void EventTranslator::lose(const EventHead& head) {
  const auto host = hosts_.find(stream_of(head).host);
  if (host == hosts_.end()) return;
  for (auto& [pid, process] : host->second.processes) {
    for (auto& [tid, thread] : process.threads)
      thread = {};
    process.queues.clear();
  }
}

const EventTranslator::Stream& EventTranslator::stream_of(const EventHead& head) const {
  static const Stream none;
  const auto index = static_cast<std::size_t>(head.stream);
  return index < streams_.size() ? streams_[index] : none;
}

std::int64_t EventTranslator::realtime(const EventHead& head) const {
  return detail::wrapping_add(head.time.ns, stream_of(head).offset_ns);
}

void EventTranslator::translate(const EventHead& head, const Untranslated& raw, const Sink& sink) {
  if (!head.pid || (raw.fields.slots == nullptr && raw.fields.fixed == nullptr)) return;
  auto& host = hosts_[stream_of(head).host];
  if (!host.has_clock) {
    host.has_clock = true;
    emit(head, ClockSync{.monotonic_ns = head.time.ns, .realtime_ns = realtime(head)}, sink);
  }
  auto& process = host.processes[*head.pid];
  process.last = head;
  Context context{.head = head,
                  .process = process,
                  .thread = process.threads[head.tid.value_or(-1)],
                  .sink = sink};
  const auto event = static_cast<Ros2Event>(raw.kind & ~ros2::kRepeats);
  const Payload p{raw.fields};
  if (is_told_better(event, p, process)) return;
  if (publish(event, p, context)) return;
  settle_thread(context);
  switch (event) {
    case Ros2Event::callback_start:
      start(p.number<Address>(0), context);
      break;
    case Ros2Event::callback_end:
      end(p.number<Address>(0), context);
      break;
    case Ros2Event::executor_wait:
      context.thread.is_waiting = p.number<std::int64_t>(0, -1) != 0;
      break;
    case Ros2Event::executor_ready:
      if (context.thread.is_waiting) {
        emit(head, ThreadWakeup{.callback = kNoCallback, .reason = std::nullopt}, sink);
      }
      context.thread.is_waiting = false;
      break;
    default:
      take(event, p, context);
      describe(event, (raw.kind & ros2::kRepeats) != 0, p, context);
      describe_agnocast(event, p, context);
      break;
  }
}

void EventTranslator::describe(Ros2Event event, bool repeats, const Payload& p, Context& context) {
  auto& directory = context.process.directory;
  const auto first = p.number<Address>(0);
  const auto second = p.number<Address>(1);
  switch (event) {
    case Ros2Event::node_init:
      directory.add_node(first, p.text(1), p.text(2));
      break;
    case Ros2Event::publisher_init: {
      const auto gid = kGid + ++publishers_;
      directory.add_publisher(first, second, p.text(2), gid, repeats);
      if (directory.publisher(first).gid == gid) links_.add_publisher(std::string(p.text(2)), gid);
      break;
    }
    case Ros2Event::subscription_init:
      directory.add_subscription(first, second, p.text(2), p.number<std::uint32_t>(3), repeats);
      break;
    case Ros2Event::subscription_object:
      directory.add_object(first, second);
      break;
    case Ros2Event::subscription_callback:
      directory.add_object_callback(first, second, repeats);
      break;
    case Ros2Event::service_init:
      directory.add_service(first, second, p.text(2), repeats);
      break;
    case Ros2Event::service_callback:
      directory.add_handle_callback(CallbackKind::service, first, second);
      break;
    case Ros2Event::timer_init:
      directory.add_timer(first, p.number<std::uint64_t>(1), repeats);
      break;
    case Ros2Event::timer_callback:
      directory.add_handle_callback(CallbackKind::timer, first, second);
      break;
    case Ros2Event::timer_node:
      directory.link_timer(first, second);
      break;
    case Ros2Event::callback_symbol:
      directory.add_symbol(first, p.text(1));
      break;
    case Ros2Event::group:
      directory.add_group(first, p.text(1));
      break;
    case Ros2Event::group_member:
      directory.join_group(first, second);
      break;
    case Ros2Event::buffer_of_object:
      directory.link_buffer(first, second);
      break;
    case Ros2Event::object_of_subscription:
      directory.link_object(first, second);
      break;
    default:
      break;
  }
}

void EventTranslator::describe_agnocast(Ros2Event event, const Payload& p, Context& context) {
  auto& process = context.process;
  auto& directory = process.directory;
  const auto handle = p.number<Address>(0);
  const auto describe_callback = [&](CallbackKind kind) {
    directory.join_group(p.number<Address>(2), handle);
    // The callback's own address is never spoken of again: those of its calls are.
    directory.stand_for(kind, handle, handle);
    directory.add_symbol(handle, p.text(3));
  };
  switch (event) {
    case Ros2Event::agnocast_subscription:
      directory.add_subscription(handle, p.number<Address>(1), p.text(4),
                                 p.number<std::uint32_t>(5), false);
      describe_callback(CallbackKind::subscription);
      process.agnocast_subscriptions[p.number<std::uint64_t>(6)] = handle;
      break;
    case Ros2Event::agnocast_timer:
      directory.add_timer(handle, p.number<std::uint64_t>(4), false);
      directory.link_timer(handle, p.number<Address>(1));
      describe_callback(CallbackKind::timer);
      break;
    case Ros2Event::agnocast_callable: {
      const auto known = process.agnocast_subscriptions.find(p.number<std::uint64_t>(2));
      if (known == process.agnocast_subscriptions.end()) break;
      directory.stand_for(CallbackKind::subscription, handle, known->second);
      process.agnocast_entries[handle] = p.number<std::int64_t>(1);
      break;
    }
    case Ros2Event::agnocast_timer_callable:
      directory.stand_for(CallbackKind::timer, handle, p.number<Address>(1));
      break;
    default:
      break;
  }
}

// Whether the event is part of a publication.
bool EventTranslator::publish(Ros2Event event, const Payload& p, Context& context) {
  auto& thread = context.thread;
  const auto is_current = [&thread](Address message) {
    return thread.publishing && thread.publishing->message == message;
  };
  switch (event) {
    case Ros2Event::publish:
      begin_publishing(p.number<Address>(0), std::nullopt, context);
      return true;
    case Ros2Event::rcl_publish: {
      const auto message = p.number<Address>(1);
      if (!is_current(message) || thread.publishing->publisher) {
        begin_publishing(message, p.number<Address>(0), context);
      }
      thread.publishing->publisher = p.number<Address>(0);
      return true;
    }
    case Ros2Event::rmw_publish:
    case Ros2Event::bind_stamp: {
      if (!is_current(p.number<Address>(0)) || !thread.publishing->publisher) return false;
      const auto stamp = p.integer(1);
      Publication publication{.from = realtime(context.head)};
      if (stamp && *stamp != 0) {
        publication.stamp = *stamp;
        publication.is_exact = true;
      }
      const auto publishing = *thread.publishing;
      thread.publishing.reset();
      tell_publication(publishing, publication, context);
      return true;
    }
    case Ros2Event::intra_publish: {
      settle_thread(context);
      const auto message = p.number<Address>(1);
      const Publishing publishing{
          .head = context.head, .message = message, .publisher = p.number<Address>(0)};
      const auto origin = tell_publication(publishing, {}, context);
      thread.writing.reset();
      thread.handed_over = origin;
      auto& by_message = context.process.handed_over;
      if (by_message.size() >= kMaxHandedOver) by_message.clear();
      by_message[message] = origin;
      return true;
    }
    case Ros2Event::agnocast_publish: {
      settle_thread(context);
      const Publishing publishing{
          .head = context.head, .message = 0, .publisher = p.number<Address>(0)};
      Publication publication;
      publication.entry = p.integer(1);
      tell_publication(publishing, publication, context);
      thread.writing.reset();
      return true;
    }
    default:
      return false;
  }
}

void EventTranslator::begin_publishing(Address message, std::optional<Address> publisher,
                                       Context& context) {
  settle_thread(context);
  context.thread.handed_over.reset();
  context.thread.publishing =
      Publishing{.head = context.head, .message = message, .publisher = publisher};
}

// The thread did something else: whatever it was writing is written.
void EventTranslator::settle_thread(Context& context) {
  auto& thread = context.thread;
  if (thread.writing) {
    thread.writing->until = realtime(context.head);
    thread.writing.reset();
  }
  if (!thread.publishing) return;
  const auto publishing = *thread.publishing;
  thread.publishing.reset();
  if (!publishing.publisher) return;
  tell_publication(publishing,
                   Publication{.from = realtime(publishing.head), .until = realtime(context.head)},
                   context);
  thread.writing.reset();
}

MessageLinks::Origin EventTranslator::tell_publication(const Publishing& publishing,
                                                       Publication publication, Context& context) {
  auto& publisher = context.process.directory.publisher(*publishing.publisher);
  if (!publisher.is_told && !publisher.topic.empty()) {
    publisher.is_told = true;
    tell_node(publishing.head, publisher.node, context);
    emit(publishing.head,
         PublisherInit{.publisher = publisher.id,
                       .node = publisher.node.value_or(kNoNode),
                       .topic = publisher.topic,
                       .writer_gid = publisher.gid,
                       .next_seq = 0},
         context.sink);
  }
  if (!publication.is_exact) {
    publication.stamp = std::max(realtime(publishing.head), publisher.last_stamp + 1);
  }
  publisher.last_stamp = std::max(publisher.last_stamp, publication.stamp);
  emit(publishing.head,
       Publish{.publisher = publisher.id,
               .seq = publisher.next_seq++,
               .source_timestamp_realtime_ns = publication.stamp},
       context.sink);
  if (publisher.topic.empty()) return {};
  publication.gid = publisher.gid;
  context.thread.writing = links_.add(publisher.topic, publication);
  return {.gid = publisher.gid, .stamp = publication.stamp};
}

void EventTranslator::take(Ros2Event event, const Payload& p, Context& context) {
  auto& thread = context.thread;
  auto& process = context.process;
  switch (event) {
    case Ros2Event::rmw_take:
      if (p.number<int>(1, 1) != 0) thread.taken = p.integer(0);
      break;
    case Ros2Event::dispatch:
      thread.taken = p.integer(1);
      break;
    case Ros2Event::message_copy:
      if (const auto original = process.handed_over.find(p.number<Address>(0));
          original != process.handed_over.end()) {
        const auto origin = original->second;
        process.handed_over[p.number<Address>(1)] = origin;
      }
      break;
    case Ros2Event::intra_dispatch:
      if (const auto message = process.handed_over.find(p.number<Address>(0));
          message != process.handed_over.end()) {
        thread.dequeued = Queued{.origin = message->second, .release = std::nullopt};
      }
      break;
    case Ros2Event::enqueue:
      enqueue(p, context);
      break;
    case Ros2Event::dequeue:
      if (const auto queued =
              process.queues.find({p.number<Address>(0), p.number<std::uint64_t>(1)});
          queued != process.queues.end()) {
        thread.dequeued = queued->second;
        process.queues.erase(queued);
      }
      break;
    default:
      break;
  }
}

void EventTranslator::enqueue(const Payload& p, Context& context) {
  auto& process = context.process;
  const auto buffer = p.number<Address>(0);
  process.queues[{buffer, p.number<std::uint64_t>(1)}] =
      Queued{.origin = context.thread.handed_over.value_or(MessageLinks::Origin{}),
             .release = context.head.time};
  const auto number = process.directory.callback_of_buffer(buffer);
  if (!number) return;
  tell_callback(*number, context);
  auto& callback = process.directory.get(*number);
  if (p.number<int>(2) != 0) ++callback.overwritten;
  emit(context.head,
       CallbackRelease{.callback = callback.id,
                       .release_seq = callback.releases++,
                       .overwritten = callback.overwritten},
       context.sink);
}

void EventTranslator::start(Address address, Context& context) {
  auto& [head, process, thread, sink] = context;
  const auto number = process.directory.callback(address);
  tell_callback(number, context);
  auto& callback = process.directory.get(number);
  CallbackStart body{.callback = callback.id,
                     .seq = callback.next_seq++,
                     .release_kind = std::nullopt,
                     .release_ns = -1};
  MessageLinks::Origin origin;
  if (const auto entry = process.agnocast_entries.find(address);
      entry != process.agnocast_entries.end()) {
    origin = links_.find_entry(callback.source, entry->second);
    process.agnocast_entries.erase(entry);
  } else if (callback.kind == CallbackKind::timer) {
    // Whatever the thread took before was another callback's.
  } else if (thread.dequeued) {
    origin = thread.dequeued->origin;
    if (thread.dequeued->release) {
      body.release_kind = ReleaseKind::data;
      body.release_ns = thread.dequeued->release->ns;
    }
  } else if (thread.taken) {
    origin = callback.source.empty() ? MessageLinks::Origin{.gid = 0, .stamp = *thread.taken}
                                     : links_.find(callback.source, *thread.taken);
  }
  body.source_timestamp_realtime_ns = origin.stamp;
  body.writer_gid = origin.gid;
  thread.taken.reset();
  thread.dequeued.reset();
  thread.handed_over.reset();
  thread.is_waiting = false;
  if (thread.open.size() >= kMaxOpen) thread.open.erase(thread.open.begin());
  thread.open.push_back(Open{.address = address, .callback = number, .seq = body.seq});
  emit(head, body, sink);
}

void EventTranslator::end(Address address, Context& context) {
  auto& [head, process, thread, sink] = context;
  thread.handed_over.reset();
  const auto found = std::find_if(thread.open.rbegin(), thread.open.rend(),
                                  [address](const Open& open) { return open.address == address; });
  const auto is_open = found != thread.open.rend();
  const auto number = is_open ? found->callback : process.directory.callback(address);
  auto& callback = process.directory.get(number);
  // An end whose start was not recorded: before the first start it tells nothing, later a loss.
  const auto seq = is_open ? found->seq : callback.next_seq == 0 ? 0 : callback.next_seq++;
  emit(head, CallbackEnd{.callback = callback.id, .seq = seq, .status = std::nullopt}, sink);
  // Those begun inside it cannot end any more.
  if (is_open) thread.open.erase(std::prev(found.base()), thread.open.end());
}

void EventTranslator::tell_node(const EventHead& head, std::optional<NodeId> id, Context& context) {
  auto* node = id ? context.process.directory.node(*id) : nullptr;
  if (node == nullptr || node->is_told) return;
  node->is_told = true;
  emit(head, NodeInit{.node = node->id, .name = node->name}, context.sink);
}

std::optional<GroupId> EventTranslator::tell_group(const EventHead& head,
                                                   const ros2::Callback& callback,
                                                   Context& context) {
  if (!callback.group) return std::nullopt;
  const auto& directory = context.process.directory;
  const auto group = directory.group(*callback.group);
  if (!group || !context.process.told_groups.insert(*callback.group).second) return group;
  emit(head,
       GroupInit{.group = *group,
                 .node = callback.node.value_or(kNoNode),
                 .type = directory.group_type(*callback.group)},
       context.sink);
  return group;
}

void EventTranslator::tell_callback(CallbackNumber number, Context& context) {
  auto& directory = context.process.directory;
  auto& callback = directory.get(number);
  if (callback.is_told || !callback.kind) return;
  callback.is_told = true;
  const auto& head = context.head;
  tell_node(head, callback.node, context);
  const auto group = tell_group(head, callback, context);
  const auto logical_id = directory.logical_id(number);
  emit(head,
       CallbackInit{.callback = callback.id,
                    .group = group.value_or(kNoGroup),
                    .node = callback.node.value_or(kNoNode),
                    .kind = callback.kind,
                    .logical_id = logical_id,
                    .source = callback.source,
                    .symbol = callback.symbol,
                    .period_ns = callback.period_ns,
                    .queue_depth = callback.queue_depth},
       context.sink);
}

void EventTranslator::finish(const Sink& sink) {
  for (auto& [name, host] : hosts_) {
    for (auto& [pid, process] : host.processes) {
      const auto head = process.last;
      Context context{
          .head = head, .process = process, .thread = process.threads[-1], .sink = sink};
      for (std::size_t i = 0; i < process.directory.callbacks(); ++i) {
        tell_callback(static_cast<CallbackNumber>(i), context);
      }
    }
  }
}

}  // namespace cie::analysis
