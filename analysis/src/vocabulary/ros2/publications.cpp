#include "publications.hpp"

#include "announcements.hpp"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

constexpr std::size_t kMaxHandedOver = 4096;

bool is_runner_unknown(const Context& context) {
  const auto& open = context.thread.open;
  return !context.process.has_own_events && (open.empty() || open.back().has_looked);
}

bool is_current(const Thread& thread, Address message) {
  return thread.publishing && thread.publishing->message == message;
}

// The call. Requires that there is one.
Publishing end(Thread& thread) {
  const auto publishing = *thread.publishing;
  thread.publishing.reset();
  if (publishing.written_on != nullptr) publishing.written_on->end_call(publishing.realtime);
  return publishing;
}

}  // namespace

bool Publications::apply(Ros2Event event, const Payload& p, Context& context) {
  auto& thread = context.thread;
  switch (event) {
    case Ros2Event::publish:
      begin(p.number<Address>(0), std::nullopt, context);
      return true;
    case Ros2Event::rcl_publish:
      name_publisher(p.number<Address>(1), p.number<Address>(0), context);
      return true;
    case Ros2Event::rmw_publish:
      find_publisher(p, context);
      [[fallthrough]];
    case Ros2Event::bind_stamp: {
      if (!is_current(thread, p.number<Address>(0)) || !thread.publishing->publisher) return false;
      const auto stamp = p.integer(1);
      WrittenMessage publication{.from = context.realtime};
      if (stamp && *stamp != 0) {
        publication.stamp = *stamp;
        publication.is_exact = true;
        if (!thread.publishing->is_doubtful) note_clock(*stamp, *thread.publishing, context);
      }
      const auto publishing = end(thread);
      if (publishing.is_doubtful) {
        add_doubtful(publishing, context);
      } else {
        tell(publishing, publication, context);
      }
      return true;
    }
    case Ros2Event::intra_publish: {
      const auto publisher = p.number<Address>(0);
      const auto origin = tell_in_process(publisher, context, std::nullopt);
      thread.handed_over = {.origin = origin,
                            .publisher = &context.process.directory.publisher(publisher)};
      auto& by_message = context.process.handed_over;
      if (by_message.size() >= kMaxHandedOver) by_message.clear();
      by_message[p.number<Address>(1)] = thread.handed_over;
      return true;
    }
    case Ros2Event::agnocast_publish: {
      std::optional<AgnocastMessage> agnocast;
      if (const auto number = p.integer(1)) {
        agnocast = {.entry = {.host = context.process.host, .number = *number},
                    .pid = context.head.pid.value_or(0)};
      }
      tell_in_process(p.number<Address>(0), context, agnocast);
      return true;
    }
    default:
      return false;
  }
}

void Publications::complete(Context& context) {
  auto& thread = context.thread;
  if (auto* message = thread.writing.get()) message->until = context.realtime;
  thread.writing.reset();
  if (!thread.publishing) return;
  const auto publishing = end(thread);
  if (publishing.is_doubtful) {
    add_doubtful(publishing, context);
    if (auto* message = thread.writing.get()) message->until = context.realtime;
  } else if (publishing.publisher) {
    tell(publishing, WrittenMessage{.from = publishing.realtime, .until = context.realtime},
         context);
  }
  thread.writing.reset();
}

void Publications::add_doubtful(const Publishing& publishing, Context& context) {
  auto& process = context.process;
  const auto topic = publishing.publisher ? process.directory.publisher(*publishing.publisher).topic
                                          : std::string();
  if (process.own_topics.contains(topic)) return;
  const WrittenMessage call{.from = publishing.realtime, .is_doubtful = true};
  auto& messages = topic.empty() ? links_.unannounced() : links_.topic(topic);
  context.thread.writing = messages.add(call);
}

void Publications::name_publisher(Address message, Address publisher, Context& context) {
  auto& thread = context.thread;
  if (!is_current(thread, message) || thread.publishing->publisher)
    begin(message, publisher, context);
  auto& publishing = *thread.publishing;
  publishing.publisher = publisher;
  auto& known = context.process.directory.publisher(publisher);
  if (publishing.written_on != nullptr || known.topic.empty() ||
      context.process.own_topics.contains(known.topic))
    return;
  if (known.messages == nullptr) known.messages = &links_.topic(known.topic);
  announce(known, context.head, context.process, context.sink);  // before anybody takes it
  publishing.written_on = known.messages;
  known.messages->begin_call(publishing.realtime);
}

void Publications::find_publisher(const Payload& rmw_publish, Context& context) {
  const auto& thread = context.thread;
  const auto message = rmw_publish.number<Address>(0);
  if (is_current(thread, message) && thread.publishing->publisher) return;
  const auto publisher = context.process.directory.publisher_of(rmw_publish.number<Address>(2));
  if (publisher) name_publisher(message, *publisher, context);
}

void Publications::begin(Address message, std::optional<Address> publisher, Context& context) {
  auto& thread = context.thread;
  auto handed_over = std::exchange(thread.handed_over, {});
  if (handed_over.publisher == nullptr && thread.publishing && !thread.publishing->publisher) {
    handed_over = thread.publishing->handed_over;  // the layer below has a copy of the message
  }
  settle(context);
  thread.publishing = Publishing{.head = context.head,
                                 .realtime = context.realtime,
                                 .channel = context.channel,
                                 .message = message,
                                 .publisher = publisher,
                                 .handed_over = handed_over};
}

void Publications::note_clock(std::int64_t source_timestamp, const Publishing& publishing,
                              Context& context) {
  auto& ahead = context.realtime_ahead;
  const auto shown = detail::wrapping_sub(source_timestamp, context.realtime);
  if (shown <= detail::wrapping_add(ahead, kOffsetError)) return;
  ahead = detail::wrapping_sub(source_timestamp, publishing.realtime);
  emit(context.head,
       ClockSync{.monotonic_ns = publishing.head.time.ns, .realtime_ns = source_timestamp},
       context.sink);
}

MessageLinks::Origin Publications::tell(const Publishing& publishing, WrittenMessage publication,
                                        Context& context,
                                        const std::optional<AgnocastMessage>& agnocast) {
  auto& publisher = context.process.directory.publisher(*publishing.publisher);
  if (context.process.own_topics.contains(publisher.topic)) return {};  // told by the process
  // rclcpp hands a message to the process's own subscriptions before it goes to the others.
  const auto& handed_over = publishing.handed_over;
  const bool is_told = handed_over.publisher == &publisher &&
                       (handed_over.origin.gid == publisher.gid || publisher.topic.empty());
  const auto last_stamp = publisher.last_stamp;
  if (!publication.is_exact) {
    publication.stamp = is_told
                            ? handed_over.origin.stamp
                            : std::max(publishing.realtime, detail::wrapping_add(last_stamp, 1));
  }
  publisher.last_stamp = std::max(last_stamp, publication.stamp);
  if (is_told) {
    publication.name = handed_over.origin.stamp;
  } else {
    announce(publisher, publishing.head, context.process, context.sink);
    emit(publishing.head,
         Publish{.publisher = publisher.id,
                 .seq = publisher.next_seq++,
                 .source_timestamp_realtime_ns = publication.stamp,
                 .is_runner_unknown = is_runner_unknown(context)},
         context.sink);
  }
  if (publisher.topic.empty()) {
    // rcl announces the publisher of /rosout by an address that it does not publish by (its messages
    // are no other topic's).
    const bool is_rosout = context.process.directory.is_seen_whole() && !links_.has_lost();
    if (publication.is_exact || !is_rosout)
      context.thread.writing = links_.unannounced().add(publication);
    return {};
  }
  if (publisher.messages == nullptr) publisher.messages = &links_.topic(publisher.topic);
  publisher.messages->tell_in(publishing.channel, publisher.told_in);
  publication.gid = publisher.gid;
  context.thread.writing = publisher.messages->add(publication, agnocast);
  return {.gid = publisher.gid, .stamp = publication.known_as()};
}

MessageLinks::Origin Publications::tell_in_process(Address publisher, Context& context,
                                                   const std::optional<AgnocastMessage>& agnocast) {
  settle(context);
  const auto origin =
      tell(Publishing{.head = context.head,
                      .realtime = context.realtime,
                      .channel = context.channel,
                      .message = 0,
                      .publisher = publisher},
           {.from = context.realtime, .until = WrittenMessage::kInProcess}, context, agnocast);
  context.thread.writing.reset();
  return origin;
}

}  // namespace cie::analysis::ros2
