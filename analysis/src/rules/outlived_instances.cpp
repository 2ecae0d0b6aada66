#include "outlived_instances.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/recorded_parts.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

// The buffers of all CPUs cover its thread's events wherever it went on, or its end may lie where one of
// them has nothing: it was never written, or what was written first was overwritten since, as in a snapshot.
std::optional<Note> why_elsewhere(const Model& model, const StreamFacts& stream, Timestamp start) {
  for (const auto& other : model.streams) {
    if (other.channel != stream.channel) continue;
    if (other.has_ended && other.packets == 0)
      return note("stream-empty", {{"stream", NamedFile{other.path}}});
    if (other.is_left_out && other.events > 0)
      return note("stream-apart-in-time", {{"stream", NamedFile{other.path}}});
    if (other.covers_from && *other.covers_from > start) {
      return note("stream-begins-later",
                  {{"stream", NamedFile{other.path}}, {"later", *other.covers_from - start}});
    }
  }
  return std::nullopt;
}

// No number and no total counts the end of the last instance, so what wrote the events has to say that
// it lost none: LTTng counts what it discards, and who copies a trace may leave events out.
std::optional<Note> why_unseen(const RuleContext& context, const CallbackFacts& callback,
                               const OpenInstance& open, const StreamFacts& stream) {
  const auto& model = context.model;
  if (!callback.is_accounted) {
    return note(callback.kind == CallbackKind::service ? "exception-or-later-response-untold"
                                                       : "exception-untold");
  }
  if (callback.last_init && callback.last_init->time > open.start.time) {
    return note("registered-again-since");
  }
  if (stream.writer != PacketWriter::lttng && !context.options.is_live) {
    return note("end-counted-by-no-total");
  }
  for (const auto& failure : context.proof.recorder_losses()) {
    if (may_be_of(model, *failure.recording, model.processes[at(callback.process)])) {
      return note("end-perhaps-not-recorded",
                  {{"why", free_text(in_words(failure, failure.problems.front()))}});
    }
  }
  if (auto why = why_elsewhere(model, stream, open.start.time))
    return note("end-perhaps-not-recorded", {{"why", *std::move(why)}});
  if (auto missing = missing_user_part(model)) return free_text(*std::move(missing));
  return std::nullopt;
}

// In a system that runs its end may come yet, unless an event of the same session came after it: these
// come in the order of their times. Nor has it one where its thread went on to something else.
bool may_end_yet(const RuleContext& context, const OpenInstance& open, const ProcessFacts& process,
                 const StreamFacts& stream) {
  const bool is_told_there = !process.traces.empty() && process.traces.back() == stream.trace;
  return !is_told_there || !context.lives.is_cut_by_end(open);
}

// Whose thread told its end was not open any more, whenever it ended.
bool has_left_thread(const RuleContext& context, const OpenInstance& open, Timestamp until) {
  const auto& threads = context.model.threads;
  if (at(open.thread) >= threads.size()) return true;  // nor is any known
  const auto since = open.start.time;
  const auto& announced_again = threads[at(open.thread)].announced_again;
  return threads[at(open.thread)].fini || (announced_again && *announced_again > since) ||
         context.lives.is_tid_given_anew(open.thread, since, until);
}

}  // namespace

std::optional<OutlivedInstance> outlived(const RuleContext& context, const CallbackFacts& callback,
                                         const OpenInstance& open) {
  const auto& model = context.model;
  const auto& process = model.processes[at(callback.process)];
  const auto* stream = find_stream(model, open.start.stream);
  const auto window_end = end_of_window(model, open.start.stream);
  const bool is_live = context.options.is_live;
  const bool is_judged = context.proof.is_interrupted(callback.process) && !callback.fini &&
                         stream != nullptr && (window_end || is_live) && process.last_seen;
  if (!is_judged || has_left_thread(context, open, process.last_seen->time)) return std::nullopt;
  if (is_live && may_end_yet(context, open, process, *stream)) return std::nullopt;
  OutlivedInstance outlived{.last = *process.last_seen, .sign = note("event-of-process-shows")};
  const auto& thread = model.threads[at(open.thread)];
  if (context.lives.of(open.thread).has_exited && thread.kernel_exit->time < outlived.last.time) {
    outlived.last = *thread.kernel_exit;
    outlived.sign = note("exit-of-thread-shows");
  }
  if (outlived.last.time <= open.start.time) return std::nullopt;
  outlived.until = std::min(outlived.last.time, window_end.value_or(outlived.last.time));
  if (auto why = why_unseen(context, callback, open, *stream)) {
    outlived.doubt =
        evidence("callback_start", open.start,
                 note("instance-has-no-end", {{"seq", open.seq}, {"why", *std::move(why)}}));
  }
  return outlived;
}

}  // namespace cie::analysis
