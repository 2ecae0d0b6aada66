// What was lost, and what is known no more because of it.
#include "event_translator.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

// What it was writing was written some time before it is seen again.
void forget(ros2::Thread& thread) {
  if (thread.publishing) thread.publishing->is_doubtful = true;
  if (auto* message = thread.writing.get()) message->is_doubtful = true;
  thread = {.publishing = thread.publishing,
            .is_named = thread.is_named,
            .writing = thread.writing,
            .beside_own = thread.beside_own,
            .is_of_executor = thread.is_of_executor};
}

// What one thread leaves for another one, and what is known of a process only as long as all of its
// events are seen.
// `may_be_made`: something may have been made, unseen.
void forget_what_is_handed_on(ros2::Process& process, bool may_be_made = true) {
  if (may_be_made) process.directory.lose();
  process.queues.clear();
  process.handed_over.clear();
  for (const auto address : std::exchange(process.callables, {}))
    process.directory.forget_address(address);
}

}  // namespace

void EventTranslator::lose(const EventHead& head, Timestamp from, Timestamp until, bool is_edge) {
  const auto& stream = stream_of(head);
  if (stream.is_kernel) return;
  auto& host = *stream.host;
  host.losses.push_back(
      {.stream = head.stream, .from = from, .until = std::max(from, until), .is_edge = is_edge});
  host.next_bound = std::min(host.next_bound, from);
  host.next_look = std::min(host.next_look, from);
  links_.lose();
}

void EventTranslator::pass_bounds(Host& host, Timestamp now) {
  const bool is_any_lost = std::ranges::any_of(
      host.losses, [now](const Loss& loss) { return !loss.is_edge && loss.from <= now; });
  std::erase_if(host.losses, [now](const Loss& loss) { return loss.until <= now; });
  host.next_bound = kLatest;
  host.is_losing = false;
  host.has_only_edges = true;
  for (const auto& loss : host.losses) {
    const bool has_begun = loss.from <= now;
    host.next_bound = std::min(host.next_bound, has_begun ? loss.until : loss.from);
    if (!has_begun) continue;
    host.has_only_edges = host.has_only_edges && loss.is_edge;
    const bool is_only = !host.is_losing || host.only_loser == loss.stream;
    host.only_loser = is_only ? loss.stream : kNone;
    host.is_losing = true;
  }
  host.next_look = host.is_losing ? kEarliest : host.next_bound;
  if (is_any_lost) forget_what_runs(host);
}

// A stream that loses events has no room for them: it loses the end of what it shows the begin of
// only with all ends that follow. So what is seen to begin and to end in it belongs together, unless
// the thread was elsewhere meanwhile. In whichever other stream a thread is seen, it may have been
// in that one since, unseen. Where a stream has but ended before others, as in a snapshot, what a thread does
// next in the same other stream follows on what it did there last.
void EventTranslator::look_at_losses(Host& host, const EventHead& head,
                                     const EmittingThread& emitting) {
  if (head.time >= host.next_bound) pass_bounds(host, head.time);
  if (!host.is_losing) return;
  auto& thread = *emitting.thread;
  const bool may_have_stayed = host.has_only_edges || head.stream == host.only_loser;
  if (!may_have_stayed || thread.seen_in != head.stream) forget(thread);
  thread.seen_in = head.stream;
  forget_what_is_handed_on(*emitting.process);
}

// Nothing is open across it. Who goes on is known by what follows.
void EventTranslator::end_gap(const Event& packet_begin, EventBatch& batch) {
  const auto& head = packet_begin.head;
  const auto gap = session_gaps_.apply(head, PacketBegin{});
  if (!gap) return;
  auto& host = *stream_of(head).host;
  host.session_begin = gap->end;
  forget_what_runs(host);
  batch.derive(&packet_begin, head, *gap);
}

// What it published meanwhile was not told.
void EventTranslator::tell_lived_on(Event& event, const Translation& translation,
                                    const ros2::Process& process, EventBatch& batch) {
  links_.lose();
  EventBatch::leave_other(event, translation);  // what it means itself is derived after that
  batch.derive(&event, event.head,
               ProcessContinued{.since = process.last.time, .stream = process.last.stream});
}

void EventTranslator::forget_what_runs(Host& host) {
  for (auto& [pid, process] : host.processes) {
    for (auto& [tid, thread] : process.threads)
      forget(thread);
    forget_what_is_handed_on(process);
  }
}

bool EventTranslator::has_events_beside(const Stream& stream) const {
  if (!stream.host->has_several_traces) return false;
  const auto describes_entities = [this](const Stream& of) {
    return of.channel < channels_.size() && channels_[of.channel].describes_entities;
  };
  return std::ranges::any_of(streams_, [&](const Stream& other) {
    return other.host == stream.host && other.trace != stream.trace && other.cpu == stream.cpu &&
           other.progress == Stream::Progress::running &&
           (other.has_callback_events || !stream.has_callback_events) &&
           (describes_entities(other) || !describes_entities(stream));
  });
}

bool EventTranslator::has_events_since(const Host& host, Timestamp time) {
  return std::ranges::any_of(
      host.processes, [time](const auto& process) { return process.second.last.time >= time; });
}

// Those of a session begin together, before anything is told.
void EventTranslator::begin_stream(const EventHead& head) {
  auto& stream = stream_of(head);
  if (!stream.bounds_window || stream.progress != Stream::Progress::awaited) return;
  stream.progress = Stream::Progress::running;
  stream.cpu = head.cpu;
  auto& channel = channel_of(head);
  if (channel.running++ == 0) {
    channel.begin = head.time;
    return;
  }
  if (!has_events_since(*stream.host, channel.begin) || has_events_beside(stream)) return;
  links_.lose();
  for (auto& [pid, process] : stream.host->processes) {
    for (auto& [tid, thread] : process.threads)
      thread.is_behind_edge = true;
    forget_what_is_handed_on(process, channel.describes_entities);
  }
}

void EventTranslator::pass_edge(const EventHead& head, ros2::Thread& thread) {
  thread.is_behind_edge = false;
  if (thread.seen_in != head.stream) forget(thread);
}

// Another session may follow.
void EventTranslator::end_stream(const EventHead& head) {
  auto& stream = stream_of(head);
  if (!stream.bounds_window || stream.progress != Stream::Progress::running) return;
  stream.progress = Stream::Progress::over;
  const bool is_early = --channel_of(head).running > 0;
  if (!is_early) {
    links_.end_channel(stream.channel, detail::wrapping_add(head.time.ns, stream.offset_ns));
    end_losses(*stream.host, stream.channel, head.time);
  } else if (!channel_of(head).ends_apart.value_or(false) && !has_events_beside(stream)) {
    lose(head, head.time, kLatest, true);
  }
}

void EventTranslator::end_losses(Host& host, std::uint32_t channel, Timestamp time) const {
  for (auto& loss : host.losses) {
    const bool is_its =
        loss.until == kLatest && streams_[static_cast<std::size_t>(loss.stream)].channel == channel;
    if (!is_its) continue;
    loss.until = time;
    host.next_bound = std::min(host.next_bound, time);
  }
}

}  // namespace cie::analysis
