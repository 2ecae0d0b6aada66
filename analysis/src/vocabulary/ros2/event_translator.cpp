#include "event_translator.hpp"

#include <cie/tracepoints/ros2_profile.hpp>

#include "announcements.hpp"
#include "descriptions.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <limits>
#include <utility>

namespace cie::analysis {

using ros2::Address;
using ros2::Context;
using ros2::emit;
using ros2::LastEvent;
using ros2::Ros2Event;
using ros2::RunningCallback;

namespace {

constexpr std::size_t kMaxOpen = 64;

// Whether the profile `ros2` says here what an event of this project's own says, too. Both are
// announced together; what runs unannounced before is left to the own ones if it can be theirs.
bool is_told_better(Ros2Event event, const Payload& p, ros2::Process& process) {
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

// Whether this project's own events say the same of their process: what runs, waits and is released.
// What began before they did still ends.
bool is_told_by_own(Ros2Event event, const Payload& p, const ros2::Thread& thread) {
  switch (event) {
    case Ros2Event::callback_end:
      return std::ranges::none_of(thread.open, [&p](const RunningCallback& open) {
        return open.address == p.number<Address>(0);
      });
    case Ros2Event::callback_start:
      return true;
    case Ros2Event::executor_wait:
    case Ros2Event::executor_ready:
      return !thread.beside_own.has_others_alone();
    default:
      return false;
  }
}

ros2::Telling telling_of(std::uint32_t kind, const Payload& p, Timestamp now) {
  if ((kind & ros2::kRepeats) == 0) return {.repeats = false, .told = now, .made = now};
  const auto slot = kind >> ros2::kMadeShift;
  const auto made = slot != 0 ? p.integer(slot) : std::nullopt;
  return {
      .repeats = true, .told = now, .made = made ? std::optional(Timestamp{*made}) : std::nullopt};
}

// A callable was called, or may have been: what lies at its address next is another one.
inline void forget_callable(Address address, ros2::Process& process) {
  if (process.callables.empty()) return;  // most often
  if (process.callables.erase(address) != 0) process.directory.forget_address(address);
}

// Since the thread's event before.
Duration quiet_before(const Context& context) {
  if (context.before == ros2::Thread::kLongAgo) {
    return Duration{std::numeric_limits<std::int64_t>::max()};
  }
  return Duration{detail::wrapping_sub(context.realtime, context.before)};
}

// Tells what the tracer calls the thread.
void tell_name(const EventHead& head, std::string_view name, const ros2::EventSink& sink) {
  if (!name.empty()) emit(head, ProcessName{.name = name}, sink);
}

}  // namespace

EventTranslator::Stream& EventTranslator::new_stream(std::size_t index) {
  if (index >= streams_.size()) streams_.resize(index + 1);
  auto& stream = streams_[index];
  stream.host = &host_of({});
  return stream;
}

EventTranslator::Host& EventTranslator::host_of(std::string name_and_clock) {
  const auto [found, is_new] = hosts_.try_emplace(std::move(name_and_clock));
  if (is_new) found->second.number = static_cast<std::uint32_t>(hosts_.size());
  return found->second;
}

void EventTranslator::find(EmittingThread& emitting, Host& host, const EventHead& head) {
  auto& process = host.processes[*head.pid];
  process.host = host.number;
  emitting = {.host = &host,
              .process = &process,
              .thread = &process.threads[head.tid.value_or(LastEvent::kNoThread)],
              .pid = head.pid,
              .tid = head.tid};
}

[[gnu::always_inline]] inline bool EventTranslator::end_at_once(const Begun& begun,
                                                                const Event& event,
                                                                const Payload& fields,
                                                                EventBatch& batch) {
  if (batch.before(event) != begun.event) return false;
  const auto& head = event.head;
  auto& start = *begun.event;
  const bool is_its = fields.number<Address>(0) == begun.address && start.head.tid == head.tid &&
                      start.head.pid == head.pid && start.head.stream == head.stream &&
                      start.head.cpu == head.cpu && head.time < begun.emitting->host->next_look;
  if (!is_its) return false;
  std::get<CallbackStart>(start.body).end = head.time;
  begun.emitting->process->last.time = head.time;
  auto& thread = *begun.emitting->thread;
  thread.last = detail::wrapping_add(head.time.ns, stream_of(head).offset_ns);
  thread.handed_over = {};
  thread.open.pop_back();
  forget_callable(begun.address, *begun.emitting->process);
  batch.take_back();
  return true;
}

bool EventTranslator::translate(Event& event, const Translation& translation, const Payload& fields,
                                EventBatch& batch) {
  // No more than a choice of two, so that it takes no frame of its own.
  if (begun_.event != nullptr && ros2::event_of(translation.kind) == Ros2Event::callback_end) {
    return translate_end(event, translation, fields, batch);
  }
  return translate_other(event, translation, fields, batch);
}

bool EventTranslator::translate_end(Event& event, const Translation& translation,
                                    const Payload& fields, EventBatch& batch) {
  return end_at_once(std::exchange(begun_, {}), event, fields, batch) ||
         translate_other(event, translation, fields, batch);
}

bool EventTranslator::translate_other(Event& event, const Translation& translation,
                                      const Payload& fields, EventBatch& batch) {
  begun_.event = nullptr;
  const auto ros2_event = ros2::event_of(translation.kind);
  if (const auto earlier = batch.take_new_before(event); !earlier.empty()) observe(earlier, batch);
  const auto& head = event.head;
  if (!head.pid) {
    EventBatch::leave_other(event, translation);
    return false;
  }
  const auto& stream = stream_of(head);
  const auto realtime = detail::wrapping_add(head.time.ns, stream.offset_ns);
  auto& host = *stream.host;
  const auto& emitting = emitting_thread(host, head);
  if (host.has_several_traces && head.tid &&
      emitting.thread->last_recorded.is_copy(stream.trace, translation, fields)) [[unlikely]] {
    EventBatch::leave_other(event, translation);
    return false;
  }
  auto& process = *emitting.process;
  const bool lived_on = process.has_emitted && process.last.time < host.session_begin;
  if (lived_on) [[unlikely]]
    tell_lived_on(event, translation, process, batch);
  process.last.time = head.time;
  process.last.stream = head.stream;
  process.last.tid = head.tid.value_or(LastEvent::kNoThread);
  if (head.time >= host.next_look) [[unlikely]]
    look_at_losses(host, head, emitting);
  if (emitting.thread->is_behind_edge) [[unlikely]]
    pass_edge(head, *emitting.thread);
  emitting.thread->seen_in = head.stream;
  const bool has_emitted = std::exchange(process.has_emitted, true);
  const ros2::EventSink sink{.batch = batch, .cause = &event};
  Context context{.head = head,
                  .realtime = realtime,
                  .before = std::exchange(emitting.thread->last, realtime),
                  .process = process,
                  .thread = *emitting.thread,
                  .sink = sink,
                  .realtime_ahead = host.realtime_ahead,
                  .channel = stream.channel};
  if (run(ros2_event, fields, context)) {
    if (ros2_event == Ros2Event::callback_start && !host.has_several_traces) {
      begun_ = {.event = &event, .address = fields.number<Address>(0), .emitting = &emitting};
    }
    return true;
  }
  EventBatch::leave_other(event, translation);
  if (host.has_clock && take_note(ros2_event, fields, context)) return lived_on;
  if (!host.has_clock) {
    host.has_clock = true;
    emit(head, ClockSync{.monotonic_ns = head.time.ns, .realtime_ns = realtime}, sink);
  }
  translate(translation.kind, has_emitted, fields, context);
  return !batch.is_silent(event);
}

[[gnu::always_inline]] inline bool EventTranslator::run(Ros2Event event, const Payload& p,
                                                        Context& context) {
  if (event != Ros2Event::callback_start && event != Ros2Event::callback_end) return false;
  auto& process = context.process;
  const auto& thread = context.thread;
  const auto address = p.number<Address>(0);
  const bool is_usual = thread.is_named && !thread.writing && !thread.publishing &&
                        !process.has_own_events && !process.shares_pid &&
                        !is_ros2_profile_handle(address);
  if (!is_usual) return false;
  if (event == Ros2Event::callback_end) {
    end(address, context);
    return true;
  }
  auto& callback = process.directory.callback(address, context.head.time);
  if (!callback.is_told) return false;
  if (!thread.open.empty() && is_of_another_process(callback, p, thread)) [[unlikely]]
    return false;
  start(address, callback, p, context);
  return true;
}

// Another thread called so begins inside an instance of this one; or a callback inside itself, whose
// address two processes of this pid have given to one of theirs.
bool EventTranslator::is_of_another_process(const ros2::Callback& callback, const Payload& start,
                                            const ros2::Thread& thread) {
  const auto name = start.text(2);
  if (!name.empty() && !thread.name.empty() && name != thread.name) return true;
  return ros2::Directory::shares_address(callback) &&
         std::ranges::any_of(thread.open, [&callback](const RunningCallback& open) {
           return open.callback == &callback;
         });
}

// What runs on the thread may have been left by an exception.
[[gnu::always_inline]] inline void EventTranslator::look(ros2::Thread& thread) {
  if (!thread.open.empty()) thread.open.back().has_looked = true;
}

[[gnu::always_inline]] inline void EventTranslator::wait(const Payload& p, ros2::Thread& thread) {
  look(thread);
  thread.is_waiting = p.number<std::int64_t>(0, -1) != 0;
  thread.taken.clear();  // whoever took that was done with it
  thread.dequeued.clear();
}

[[gnu::always_inline]] inline bool EventTranslator::take_note(Ros2Event event, const Payload& p,
                                                              Context& context) {
  auto& thread = context.thread;
  const bool is_usual = !thread.writing && !thread.publishing && !context.process.has_own_events;
  if (!is_usual) return false;
  if (event == Ros2Event::executor_wait) {
    wait(p, thread);
    return true;
  }
  if (event != Ros2Event::executor_ready || thread.is_waiting) return false;
  look(thread);
  return true;
}

void EventTranslator::translate(std::uint32_t kind, bool has_emitted, const Payload& p,
                                Context context) {
  const auto& [head, realtime, before, process_of_event, thread_of_event, sink, realtime_ahead,
               channel] = context;
  auto& process = context.process;
  const auto event = ros2::event_of(kind);
  if (is_told_better(event, p, process)) return;
  is_ros2_told_ = true;
  link_messages();
  if (publications_.apply(event, p, context)) return;
  publications_.settle(context);
  if (process.has_own_events && is_told_by_own(event, p, context.thread)) {
    context.thread.handed_over = {};
    if (event != Ros2Event::callback_start) return;
    if (process.has_begun_beside_own) emit(head, ForeignInstance{}, sink);
    if (!is_of_other_executor(p, context)) {
      context.thread.dequeued.clear();  // what it was given
      return;
    }
  }
  const auto telling = telling_of(kind, p, head.time);
  if (telling.repeats) process.is_repeated = true;
  switch (event) {
    case Ros2Event::begin: {
      auto of_process = head;  // its thread need not run any callback
      of_process.tid.reset();
      tell_name(of_process, p.text(2), sink);
      // What tells it again when a recording begins tells everything that was made since.
      const bool is_own = is_ros2_profile_handle(p.number<Address>(0));
      if (!has_emitted || telling.repeats || is_own) emit(head, Ros2ProcessBegin{}, sink);
      if (!has_emitted) process.directory.see_whole();
      if (!is_own) enter_begin(p.number<Address>(0), telling, has_emitted, process);
      if (const auto version = p.text(1); !version.empty() && !is_own) {
        emit(head, Ros2Tracer{.version = version}, sink);
      }
      break;
    }
    case Ros2Event::callback_start: {
      if (process.shares_pid) break;
      if (!std::exchange(context.thread.is_named, true)) {
        context.thread.name = p.text(2);
        tell_name(head, context.thread.name, sink);
      }
      const auto address = p.number<Address>(0);
      auto& callback = process.directory.callback(address, head.time);
      if (!callback.is_told) announce(callback, head, process, sink);
      const bool is_inside = !context.thread.open.empty();
      if (is_inside && is_of_another_process(callback, p, context.thread)) {
        process.shares_pid = true;
        emit(head, InterleavedInstances{}, sink);
        break;
      }
      start(address, callback, p, context);
      break;
    }
    case Ros2Event::callback_end:
      if (!process.shares_pid) end(p.number<Address>(0), context);
      break;
    case Ros2Event::executor_wait:
      wait(p, context.thread);
      break;
    case Ros2Event::executor_ready:
      look(context.thread);
      if (context.thread.is_waiting) {
        sink.batch.derive_instead<ThreadWakeup>(sink.cause, head).callback = kNoCallback;
      }
      context.thread.is_waiting = false;
      break;
    default:
      take(event, p, context);
      if (describes_entities(event)) channel_of(head).describes_entities = true;
      enter_description(event, telling, p, process, quiet_before(context), links_);
      services_.apply(event, telling, p, context);
      for (const auto hidden : process.directory.news_of_hidden())
        announce_hidden(hidden, head, process, sink);
      break;
  }
}

[[gnu::always_inline]] inline void EventTranslator::start(Address address, ros2::Callback& callback,
                                                          const Payload& p, Context& context) {
  auto& [head, realtime, before, process, thread, sink, realtime_ahead, channel] = context;
  const auto seq = callback.next_seq++;
  Taken message;
  const bool may_have_taken = !thread.taken.is_empty() || !thread.dequeued.is_empty() ||
                              callback.is_taking_told || callback.is_queue_told ||
                              callback.kind == CallbackKind::service ||
                              !process.agnocast_entries.empty();
  if (may_have_taken) {
    message = taken_by(callback, address, p, context);
    thread.taken.start();
    thread.dequeued.start();
  }
  thread.handed_over = {};
  thread.is_waiting = false;
  if (thread.open.size() >= kMaxOpen) thread.open.erase(thread.open.begin());
  thread.open.push_back(RunningCallback{.address = address, .callback = &callback, .seq = seq});
  if (callback.kind == CallbackKind::service) services_.note_instance(thread.open.back(), context);
  thread.requested.reset();
  auto& body = sink.batch.derive_instead<CallbackStart>(sink.cause, head);
  body.callback = callback.id;
  body.seq = seq;
  body.source_timestamp_realtime_ns = message.origin.stamp;
  body.writer_gid = message.origin.gid;
  body.is_writer_undecided = message.origin.is_undecided;
  body.may_be_another = process.directory.may_be_another(callback);
  if (message.release) {
    body.release_kind = ReleaseKind::data;
    body.release_ns = message.release->ns;
  }
  if (message.origin.shows_unseen_writer) [[unlikely]]
    emit(head, UntracedWriter{.topic = callback.source}, sink);
}

[[gnu::always_inline]] inline void EventTranslator::end(Address address, Context& context) {
  auto& [head, realtime, before, process, thread, sink, realtime_ahead, channel] = context;
  thread.handed_over = {};
  auto found = thread.open.rbegin();  // most often it is this one
  while (found != thread.open.rend() && found->address != address)
    ++found;
  const auto is_open = found != thread.open.rend();
  const bool is_across = !is_open && thread.has_skipped(address);
  auto& callback = is_open ? *found->callback : process.directory.callback(address, head.time);
  // An end whose start was not recorded: before the first start it tells nothing, later a loss.
  const auto seq = is_open ? found->seq : callback.next_seq == 0 ? 0 : callback.next_seq++;
  auto& body = sink.batch.derive_instead<CallbackEnd>(sink.cause, head);
  body.callback = callback.id;
  body.seq = seq;
  body.may_be_another = !is_open && process.directory.may_be_another(callback);
  // Those begun inside it cannot end any more.
  if (is_open) {
    if (found != thread.open.rbegin()) thread.skipped.assign(found.base(), thread.open.end());
    thread.open.erase(std::prev(found.base()), thread.open.end());
  } else if (is_across) {
    process.shares_pid = true;
    emit(head, InterleavedInstances{}, sink);
  }
  forget_callable(address, context.process);
}

void EventTranslator::finish(EventBatch& batch) {
  for (auto& [name, host] : hosts_) {
    for (auto& [pid, process] : host.processes) {
      if (process.has_own_events) continue;
      process.is_repeated = false;  // nothing more will be
      const auto& [time, stream, tid] = process.last;
      EventHead head{.time = time, .stream = stream, .cpu = {}, .pid = pid, .tid = {}};
      if (tid != LastEvent::kNoThread) head.tid = tid;
      for (auto& callback : process.directory.callbacks())
        announce(callback, head, process, {.batch = batch});
      for (std::uint32_t i = 0; i < process.directory.hidden_callbacks(); ++i) {
        if (!process.directory.hidden(i).group) continue;  // which may have been told since
        announce_hidden(i, head, process, {.batch = batch});
      }
    }
  }
  // The report needs as much memory as the messages.
  links_.forget_messages();
}

}  // namespace cie::analysis
