// The messages that callbacks are given.
#include "announcements.hpp"
#include "event_translator.hpp"

namespace cie::analysis {

using ros2::Address;
using ros2::Context;
using ros2::emit;
using ros2::MessageLinks;
using ros2::QueuedMessage;
using ros2::Ros2Event;

void EventTranslator::take(Ros2Event event, const Payload& p, Context& context) {
  auto& thread = context.thread;
  auto& process = context.process;
  switch (event) {
    case Ros2Event::rmw_take:
      if (const auto stamp = p.integer(1); stamp && p.number<int>(2, 1) != 0)
        thread.taken.add(p.number<Address>(0), *stamp);
      break;
    case Ros2Event::dispatch:
      if (const auto stamp = p.integer(1)) thread.taken.add(Address{}, *stamp);
      break;
    case Ros2Event::message_copy:
      if (const auto original = process.handed_over.find(p.number<Address>(0));
          original != process.handed_over.end()) {
        const auto message = original->second;
        process.handed_over[p.number<Address>(1)] = message;
      }
      break;
    case Ros2Event::intra_dispatch:
      if (const auto message = process.handed_over.find(p.number<Address>(0));
          message != process.handed_over.end()) {
        thread.dequeued.add(nullptr, QueuedMessage{.message = message->second});
      }
      break;
    case Ros2Event::subscription_init:
    case Ros2Event::buffer_of_object:
    case Ros2Event::object_of_subscription:
      // A subscription is made: what it is handed first was kept, by whomever.
      thread.handed_over = {};
      break;
    case Ros2Event::enqueue:
      enqueue(p, context);
      break;
    case Ros2Event::dequeue:
      if (const auto queued =
              process.queues.find({p.number<Address>(0), p.number<std::uint64_t>(1)});
          queued != process.queues.end()) {
        thread.dequeued.add(queued->second.receiver, queued->second);
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
  auto* callback = process.directory.callback_of_buffer(buffer);
  process.queues[{buffer, p.number<std::uint64_t>(1)}] = QueuedMessage{
      .message = context.thread.handed_over, .receiver = callback, .release = context.head.time};
  if (callback == nullptr || process.has_own_events) return;
  announce(*callback, context.head, process, context.sink);
  if (p.number<int>(2) != 0) ++callback->overwritten;
  emit(context.head,
       CallbackRelease{.callback = callback->id,
                       .release_seq = callback->releases++,
                       .overwritten = callback->overwritten,
                       .may_be_another = process.directory.may_feed_another(buffer, *callback)},
       context.sink);
}

// The message that a callback which starts was given; none if it is unknown.
EventTranslator::Taken EventTranslator::taken_by(ros2::Callback& callback, Address address,
                                                 const Payload& start, Context context) {
  auto& [head, realtime, before, process, thread, sink, realtime_ahead, channel] = context;
  if (!process.agnocast_entries.empty()) {
    const auto entry = process.agnocast_entries.find(address);
    if (entry != process.agnocast_entries.end()) {
      const auto origin =
          links_.find_entry(callback.source, {.host = process.host, .number = entry->second});
      process.agnocast_entries.erase(entry);
      return {.origin = origin};
    }
  }
  // Whatever the thread took before a timer's callback was another one's.
  if (callback.kind == CallbackKind::timer) return {};
  if (callback.kind == CallbackKind::service) {
    return {.origin = services_.requested(callback, context)};
  }
  // What told of its message before tells no more: that event was lost.
  const auto none = [](bool is_told) { return Taken{.origin = {.is_undecided = is_told}}; };
  if (const auto queued = thread.dequeued.give(&callback)) {
    callback.is_queue_told = true;
    return {.origin = queued->message.origin_on(callback.source), .release = queued->release};
  }
  // A message from within the process was taken from no writer: that was another one.
  const bool is_intra_process = start.number<int>(1) != 0;
  if (is_intra_process) return none(callback.is_queue_told);
  const auto stamp = thread.taken.give(callback.rmw_subscription);
  if (!stamp) return none(callback.is_taking_told);
  callback.is_taking_told = true;
  return {.origin = callback.source.empty()
                        ? MessageLinks::Origin{.gid = 0, .stamp = *stamp}
                        : links_.find(callback.source, *stamp, take_at(realtime, realtime_ahead))};
}

}  // namespace cie::analysis
