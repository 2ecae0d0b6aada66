#include "shared_doubts.hpp"

#include "callback_doubts.hpp"
#include "judgement.hpp"
#include "model/recorded_parts.hpp"
#include "time_namespaces.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace cie::analysis {
namespace {

// Rules that judge instances have no subject at all when no start was recorded.
std::optional<SubjectVerdict> absent_starts(const Rule& rule, const RuleContext& context) {
  const auto& model = context.model;
  if (!rule.needs.instances || model.events.by_name.contains("callback_start")) {
    return std::nullopt;
  }
  const auto& callbacks = model.callbacks;
  const auto has_run = std::ranges::find_if(callbacks, [](const CallbackFacts& callback) {
    return callback.ended.count != 0 || callback.starts_outside != 0 ||
           (callback.fini && callback.fini->started != 0);
  });
  if (has_run == callbacks.end()) return std::nullopt;
  Judgement judgement(NamedSubject::trace(), context.known);
  const bool has_outside = std::ranges::any_of(
      callbacks, [](const CallbackFacts& callback) { return callback.starts_outside != 0; });
  judgement.unseen(without_event(
      moment(model.begin), has_outside ? "no callback started in the window"
                                       : "callbacks ran, but no callback_start was recorded"));
  return std::move(judgement).finish();
}

// What no process can be told of may have been anybody's instances.
void doubt_events_without_pid(const Rule& rule, const RuleContext& context,
                              std::vector<SubjectVerdict>& subjects) {
  const auto without = context.model.events.cie_without_pid;
  const bool is_judged = context.options.spec != nullptr || !rule.needs.spec;
  if (without == 0 || !rule.needs.instances || !is_judged) return;
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.unseen(
      without_event(moment(context.model.begin),
                    counted(without, "event") + " without the context vpid belong to no process"));
  conclude(std::move(judgement), subjects);
}

Evidence sharing(const ProcessFacts& process) {
  const auto since = [&process](const char* why) {
    return without_event(*process.shares_pid_since, why);
  };
  switch (process.pid_sharing) {
    case PidSharing::other_init:
      return since(
          "another process or program of this pid has another callback of this id, and its "
          "first run_begin was not recorded");
    case PidSharing::perhaps:
      return since(
          "events were lost since the run_end of this pid: what follows may be of another "
          "process, and its run_begin was not recorded");
    case PidSharing::announced_late:
      return since(
          "this process began before the last instances that are told of the former one of its pid: "
          "they are its own, and of the former one's which are is unknown");
    case PidSharing::told_again:
      return since(
          "what a process tells once came twice: another one has this pid, and its run_begin was "
          "not recorded");
    case PidSharing::crossed:
      return since(
          "instances on one thread overlap and do not nest, or none of its process can nest so: two "
          "processes have this pid, as those of containers, which the context pid_ns tells apart");
    case PidSharing::beside_own:
      return since(
          "ROS 2's events tell of an instance since another rcl_init of this pid, of which this "
          "project's tell nothing: another process has it, or another executor runs there");
    case PidSharing::begun:
      break;
  }
  return since(
      "two processes have this pid: containers, which need a recording each, or a child "
      "of fork() without exec(), which needs LD_PRELOAD=liblttng-ust-fork.so.1");
}

SharedPids shared_pids(const Model& model) {
  SharedPids shared;
  for (const auto& process : model.processes) {
    if (!process.shares_pid_since) continue;
    shared.any = sharing(process);
    shared.by_pid.insert_or_assign({process.host, process.told_pid}, *shared.any);
  }
  return shared;
}

// Of processes whose events cannot be told apart neither a pass nor a violation is proven. A
// subject of no process, or of several, may be any process's.
void doubt_shared_pids(const Rule& rule, const Model& model, const SharedPids& shared,
                       std::vector<SubjectVerdict>& subjects) {
  if (!shared.any) return;
  for (auto& subject : subjects) {
    const bool is_about_trace =
        subject.about.kind == SubjectKind::trace && rule.needs.is_about_trace;
    if (is_about_trace || subject.verdict == Verdict::not_applicable) continue;
    auto since = shared.any;
    if (subject.about.process) {
      const auto& process = model.processes[at(*subject.about.process)];
      const auto found = shared.by_pid.find({process.host, process.told_pid});
      if (found == shared.by_pid.end()) continue;
      since = found->second;
    }
    subject.verdict = Verdict::inconclusive;
    subject.evidence = {*since};
  }
}

// Keeps what was seen as evidence, behind the reason.
void leave_undecided(SubjectVerdict& subject, Evidence reason) {
  subject.verdict = Verdict::inconclusive;
  subject.evidence.insert(subject.evidence.begin(), std::move(reason));
}

// Of a machine whose processes do not share a clock neither a pass nor a violation is proven.
void doubt_clocks_apart(const Rule& rule, const Model& model,
                        const std::map<HostIndex, Evidence>& apart,
                        std::vector<SubjectVerdict>& subjects) {
  if (apart.empty() || rule.needs.is_about_trace) return;
  for (auto& subject : subjects) {
    const auto& process = subject.about.process;
    const auto found = process ? apart.find(model.processes[at(*process)].host) : apart.begin();
    if (found == apart.end() || subject.verdict == Verdict::not_applicable) continue;
    leave_undecided(subject, found->second);
  }
}

// Of what the process's own events leave out nothing is judged where these are all here.
void doubt_told_by_own(const RuleContext& context, std::vector<SubjectVerdict>& subjects) {
  for (auto& subject : subjects) {
    const auto& about = subject.about;
    if (subject.verdict != Verdict::fail || about.kind != SubjectKind::callback || !about.index)
      continue;
    if (auto doubt = perhaps_told_by_own(context.model, context.proof, context.losses,
                                         context.model.callbacks[*about.index]))
      leave_undecided(subject, *std::move(doubt));
  }
}

// L7: of what is missing nobody knows what a rule would have said, so what is left does not pass in
// its place. A subject is judged as ever: its numbers and totals tell what it lost.
void doubt_missing_part(const Rule& rule, const RuleContext& context, const std::string& missing,
                        std::vector<SubjectVerdict>& subjects) {
  if (context.options.spec == nullptr && rule.needs.spec) return;
  const auto doubt = evidence("missing_part", moment(context.model.begin), missing);
  const bool is_doubted = std::ranges::any_of(subjects, [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace && subject.verdict >= Verdict::inconclusive;
  });
  if (is_doubted) return;
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.unseen(doubt);
  conclude(std::move(judgement), subjects);
}

// A subject has one verdict: the worst of those of the trace, with what any of them rests on.
void join_those_of_trace(std::vector<SubjectVerdict>& subjects) {
  const auto is_of_trace = [](const SubjectVerdict& subject) {
    return subject.about.kind == SubjectKind::trace;
  };
  const auto first = std::ranges::find_if(subjects, is_of_trace);
  if (first == subjects.end()) return;
  for (auto next = std::next(first); next != subjects.end();) {
    if (!is_of_trace(*next)) {
      ++next;
      continue;
    }
    if (next->verdict > first->verdict) std::swap(*first, *next);
    first->checked += next->checked;
    std::ranges::move(next->evidence, std::back_inserter(first->evidence));
    next = subjects.erase(next);
  }
}

std::optional<std::string> not_all_is_here(const std::optional<std::string>& missing) {
  return missing ? std::optional("not all that was recorded is here: " + *missing) : std::nullopt;
}

std::optional<std::string> not_all_was_recorded(const std::vector<RecorderFailure>& losses) {
  if (losses.empty()) return std::nullopt;
  return "not all that happened may be recorded: " +
         in_words(losses.front(), losses.front().problems.front());
}

}  // namespace

SharedDoubts::SharedDoubts(const RuleContext& context)
    : context_(context),
      missing_{.of_user = not_all_is_here(missing_user_part(context.model)),
               .of_kernel = not_all_is_here(missing_kernel_part(context.model)),
               .of_recorder = not_all_was_recorded(context.proof.recorder_losses())},
      shared_(shared_pids(context.model)),
      clocks_apart_(clocks_apart(context.model)) {}

void SharedDoubts::apply(const Rule& rule, std::vector<SubjectVerdict>& subjects) const {
  if (subjects.empty()) {
    if (auto absent = absent_starts(rule, context_)) subjects.push_back(*absent);
  }
  doubt_events_without_pid(rule, context_, subjects);
  doubt_shared_pids(rule, context_.model, shared_, subjects);
  doubt_clocks_apart(rule, context_.model, clocks_apart_, subjects);
  doubt_told_by_own(context_, subjects);
  const auto& missing = missing_.for_rule(rule);
  if (missing) doubt_missing_part(rule, context_, *missing, subjects);
  join_those_of_trace(subjects);
}

}  // namespace cie::analysis
