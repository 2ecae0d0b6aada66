// The frame that most rules share: one judgement per subject, in the order of the facts that
// verdicts are named by. A subject that `judge` returns from without a finding gets no verdict.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "judgement.hpp"
#include "rule_context.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis {

// judge(CallbackIndex, const CallbackFacts&, Judgement&).
template <typename Judge>
std::vector<SubjectVerdict> judge_callbacks(const RuleContext& context, const Judge& judge) {
  std::vector<SubjectVerdict> verdicts;
  verdicts.reserve(context.callbacks.size());
  for (const auto index : context.callbacks) {
    Judgement judgement(context.names.callback(index), context.known);
    judge(index, context.model.callbacks[at(index)], judgement);
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// judge(ThreadIndex, const ThreadFacts&, Judgement&).
template <typename Judge>
std::vector<SubjectVerdict> judge_threads(const RuleContext& context, const Judge& judge) {
  std::vector<SubjectVerdict> verdicts;
  for (std::size_t i = 0; i < context.model.threads.size(); ++i) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    Judgement judgement(context.names.thread(index), context.known);
    judge(index, context.model.threads[i], judgement);
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// Callbacks that nobody saw may have run on the thread, beside those that it ran.
inline void need_no_others(const RuleContext& context, ThreadIndex thread, Judgement& judgement) {
  judgement.unseen(context.hidden.beside_own(thread));
  judgement.needs(context.known.unseen_run(thread));
  if (!context.model.threads[at(thread)].ran.empty())
    judgement.needs(context.known.unseen_callback(thread));
}

// Starts without the context vtid belong to no thread: a rule about threads would judge the others
// alone, or none.
inline void note_missing_vtid(const RuleContext& context, std::vector<SubjectVerdict>& verdicts) {
  const auto found = std::ranges::find_if(context.model.callbacks, [](const CallbackFacts& facts) {
    return facts.starts_without_tid != 0;
  });
  if (found == context.model.callbacks.end()) return;
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.unseen(evidence("vtid", found->starts.first_at, note("starts-without-vtid")));
  conclude(std::move(judgement), verdicts);
}

// A process with a callback that ran nobody knows where, and without a thread that is known to have run
// any: a rule about threads would judge none.
inline void note_runs_lost_whole(const RuleContext& context,
                                 std::vector<SubjectVerdict>& verdicts) {
  std::set<ProcessIndex> judged;
  for (const auto& thread : context.model.threads) {
    if (!thread.ran.empty() || is_isolated(thread)) judged.insert(thread.process);
  }
  for (std::size_t i = 0; i < context.model.processes.size(); ++i) {
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    if (judged.contains(index)) continue;
    Judgement judgement(context.names.process(index), context.known);
    if (const auto lost = context.losses.anywhere(index))
      judgement.needs(context.known.lost_end(*lost));
    conclude(std::move(judgement), verdicts);
  }
}

}  // namespace cie::analysis
