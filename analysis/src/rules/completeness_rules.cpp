#include "completeness_rules.hpp"

#include "../subjects.hpp"
#include "each_subject.hpp"
#include "judgement.hpp"
#include "proof.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <string>
#include <string_view>

namespace cie::analysis {
namespace {

std::vector<SubjectVerdict> judge_seq_contiguous(const RuleContext& context) {
  const auto& model = context.model;
  const Subjects names(model);
  const Proof proof(model);
  auto verdicts = judge_callbacks(
      model, [&](CallbackIndex, const CallbackFacts& callback, Judgement& judgement) {
        judgement.check(callback.starts.count);
        judgement.doubt(proof.gap(callback));
        if (!callback.is_accounted && callback.starts.count != 0) {
          judgement.doubt(evidence("callback_start", callback.starts.first_at,
                                   "its tracer numbers no instances, as cie:callback_start does"));
        }
      });
  // Threads and publishers are named only if their numbers jump.
  auto of_threads =
      judge_threads(model, [&](ThreadIndex, const ThreadFacts& thread, Judgement& judgement) {
        judgement.doubt(proof.gap(thread));
      });
  std::ranges::move(of_threads, std::back_inserter(verdicts));
  for (const auto& publisher : model.publishers) {
    Judgement judgement(names.topic(publisher));
    judgement.doubt(proof.gap(publisher));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

std::vector<SubjectVerdict> judge_run_complete(const RuleContext& context) {
  const auto& model = context.model;
  const Subjects names(model);
  const Proof proof(model);
  std::vector<SubjectVerdict> verdicts;
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!process.has_cie_events) continue;
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    Judgement judgement(names.process(index));
    judgement.check(1 + proof.totals_compared(index));
    if (!process.run_begin) {
      judgement.doubt(evidence("run_begin", process.first_seen.value_or(EventRef{}),
                               "no run_begin of this process"));
    }
    const auto last = process.last_seen.value_or(EventRef{});
    const auto& window = context.options.window;
    const bool outlives_window = window && last.time > window->to;
    if (!process.run_end) {
      auto note = evidence("run_end", last,
                           "interrupted: no run_end; this is the last event of the process");
      if (context.options.allow_crash || outlives_window) {
        judgement.remark(std::move(note));
      } else {
        judgement.doubt(std::move(note));
      }
    }
    for (const auto& disagreement : proof.disagreements(index))
      judgement.doubt(disagreement);
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

// Instances of the callback that are known to have run, seen or counted.
std::uint64_t known_instances(const Model& model, const CallbackFacts& callback) {
  const bool is_attached =
      model.processes[at(callback.process)].first_moment == RunMoment::announce;
  std::uint64_t count = callback.starts.count + callback.starts_outside;
  if (callback.fini) count = std::max(count, callback.fini->started);
  if (is_attached && callback.registered) count = std::max(count, callback.first_next_seq);
  return count;
}

void judge_specified(const RuleContext& context, const SpecEntry& entry,
                     const std::vector<CallbackIndex>& registered, const Subjects& names,
                     const Proof& proof, std::vector<SubjectVerdict>& verdicts) {
  const auto& model = context.model;
  const bool has_run = std::ranges::any_of(registered, [&model](CallbackIndex index) {
    return known_instances(model, model.callbacks[at(index)]) > 0;
  });
  const auto asked = place(context, entry.line) + " specifies " + entry.id;
  const auto judge = [&](Judgement judgement, const CallbackFacts* callback) {
    judgement.check();
    if (callback != nullptr && known_instances(model, *callback) > 0) {
      conclude(std::move(judgement), verdicts);
      return;
    }
    bool is_any = false;
    for (std::size_t i = 0; i < model.processes.size(); ++i) {
      const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
      if (!model.processes[i].has_cie_events) continue;
      is_any = true;
      judgement.overrule(proof.incompleteness(index));
    }
    if (callback != nullptr) {
      judgement.fail(evidence("callback_init", *callback->registered,
                              asked + ", which was registered here and never ran"));
      if (callback->fini) {
        judgement.fail(evidence("callback_fini", callback->fini->at, "started 0 times"));
      }
    } else {
      judgement.fail(evidence("callback_init", moment(model.begin.value_or(Timestamp{})),
                              asked + ", which was never registered"));
      for (const auto& process : model.processes) {
        if (!process.run_end) continue;
        judgement.fail(evidence("run_end", process.run_end->at,
                                std::to_string(process.run_end->callbacks) +
                                    " callbacks were registered, all of them seen"));
      }
    }
    if (!is_any) {
      judgement.overrule(evidence("run_begin", moment(model.begin.value_or(Timestamp{})),
                                  "the trace holds no process of ours"));
    }
    conclude(std::move(judgement), verdicts);
  };
  if (registered.empty()) {
    judge(Judgement(Subjects::callback_named(entry.id)), nullptr);
  }
  for (const auto index : registered) {
    const auto& callback = model.callbacks[at(index)];
    // One lifetime that ran is enough: the others need not have.
    if (has_run && known_instances(model, callback) == 0) continue;
    judge(Judgement(names.callback(index)), &callback);
  }
}

std::vector<SubjectVerdict> judge_specified_seen(const RuleContext& context) {
  std::vector<SubjectVerdict> verdicts;
  if (context.options.spec == nullptr) return verdicts;
  const Subjects names(context.model);
  const Proof proof(context.model);
  std::map<std::string_view, std::vector<CallbackIndex>> by_id;
  for (const auto index : callbacks_in_order(context.model)) {
    const auto& callback = context.model.callbacks[at(index)];
    if (callback.registered) by_id[callback.logical_id].push_back(index);
  }
  for (const auto& entry : context.options.spec->callbacks()) {
    if (!entry.is_wildcard()) {
      judge_specified(context, entry, by_id[entry.id], names, proof, verdicts);
    }
  }
  return verdicts;
}

}  // namespace

const Rule kSeqContiguous{
    "T3", "seq-contiguous",
    "The numbers that each callback, publisher and thread counts its events with have no hole: "
    "nothing was lost silently. The first start of a callback carries the number its "
    "announcement promised; an end below the first start belongs to an instance that the "
    "recording's begin cut.\n"
    "Why it matters: A tracer's own count of losses can be wrong or missing; contiguous numbers "
    "cannot.\n"
    "Inconclusive when a number jumps: the hole is named, and every rule that judges each "
    "instance of that subject is INCONCLUSIVE as well.\n"
    "Remedy: see T2; after a copy, compare the files with the recording's manifest.",
    judge_seq_contiguous};

const Rule kRunComplete{
    "T4", "run-complete",
    "The process was seen from its run_begin to its run_end, and what it counted (callbacks, "
    "threads, groups, publishers, instances started and ended, messages, read-backs) is what "
    "the trace shows.\n"
    "Why it matters: That something did not happen can only be said of a recording that is "
    "known to be whole.\n"
    "Inconclusive when run_begin or run_end is missing (\"interrupted\": the process crashed, "
    "or the recording stopped first), or a total differs from what was seen. --allow-crash "
    "accepts an interrupted process; the other rules judge what was seen.\n"
    "Remedy: start the recording before the application and end the application before the "
    "recording; find out why it crashed.",
    judge_run_complete};

const Rule kSpecifiedCallbackSeen{
    "M1", "specified-callback-seen",
    "Every callback that the scheduling spec names exactly was registered and ran at least "
    "once.\n"
    "Why it matters: A misspelt id configures nothing, silently: the callback that was meant "
    "runs with default parameters.\n"
    "Inconclusive when it was not seen, and there is no proof that nothing is missing from the "
    "trace.\n"
    "Remedy: take ids from cie spec template; let the recording last until the callback has "
    "run; remove entries of callbacks that are gone.",
    judge_specified_seen};

}  // namespace cie::analysis
