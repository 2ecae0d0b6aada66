#include "parameters_in_force.hpp"

#include "judgement.hpp"
#include "model/parameters_in_force.hpp"
#include "parameter_words.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

namespace cie::analysis {
namespace {

// "EPERM: Operation not permitted"; numbers are Linux's on all its machines that we know.
std::string error_words(std::int32_t error) {
  const char* const name = ::strerrorname_np(error);
  return name == nullptr ? "errno " + std::to_string(error)
                         : name + (": " + std::generic_category().message(error));
}

// All of them, the last one up to now.
std::vector<InForce> all_in_force(const Model& model, const ThreadFacts& thread) {
  auto all = thread.in_force;
  if (all.empty() || all.back().until) return all;
  std::uint64_t starts = 0;
  for (const auto* pair : thread.ran)
    starts += pair->starts;
  note_starts_in_force(model, thread, starts, nullptr, all.back());
  return all;
}

// Before that, instances are S2's. Empty: none match.
std::optional<ReadBack> first_match(const Model& model, const ThreadFacts& thread,
                                    const Announcement& own, const SpecEntry& entry) {
  const auto matches = [&](const ReadBack& read) {
    return own.holds(read) && is_as_specified(read, entry.parameters) == true;
  };
  const auto found = std::ranges::find_if(thread.applied, matches);
  if (found != thread.applied.end()) return *found;
  const bool is_attached = model.processes[at(thread.process)].first_moment == RunMoment::announce;
  if (is_attached && thread.first_audit && matches(*thread.first_audit)) return *thread.first_audit;
  return std::nullopt;
}

enum class WhoseSpec { this_one, another, unknown };

// The spec that the process had meanwhile, as of a reload and another one back.
WhoseSpec spec_meanwhile(const RuleContext& context, const ProcessFacts& process,
                         const InForce& in_force) {
  const auto& specs = process.specs;
  const auto& sha256 = context.options.spec->sha256();
  const bool is_named =
      std::ranges::any_of(specs, [&](const auto& loaded) { return loaded.sha256 == sha256; });
  if (!is_named) {
    const bool may_be_reload = specs.size() > 1 && in_force.since.change != 0;
    return may_be_reload ? WhoseSpec::unknown : WhoseSpec::this_one;
  }
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const auto next = i + 1 < specs.size() ? specs[i + 1].since : kLatest;
    const bool is_then =
        specs[i].since < in_force.until.value_or(kLatest) && next > in_force.since.at.time;
    if (is_then && specs[i].sha256 != sha256) return WhoseSpec::another;
  }
  return WhoseSpec::this_one;
}

// Other parameters were applied before the instance started, or another spec was given.
std::vector<Conjunction> excuses_of(const RuleContext& context, ThreadIndex index,
                                    const InForce& in_force) {
  const auto begin = in_force.since.at.time;
  const auto end = in_force.start->at.time;
  auto excuses = context.known.read_backs(index, begin, end);
  if (in_force.since.change != 0) {
    const auto process = context.model.threads[at(index)].process;
    excuses.push_back({context.known.announced_anew(process, begin, end)});
  }
  return excuses;
}

Evidence what_ran(const RuleContext& context, const SpecEntry& entry, const ReadBack& read) {
  return evidence("thread_sched", read.at,
                  note("ran-unlike-asked", {{"asked", asks(context, entry)},
                                            {"parameters", describe(read)},
                                            {"change", since_change(read)},
                                            {"failure", failure_of(read)}}));
}

Evidence what_started(const Model& model, const InForce& in_force) {
  const auto& [callback, seq, at_start, is_certain] = *in_force.start;
  return evidence(
      "callback_start", at_start,
      note("started-then", {{"callback", NamedCallback{model.callbacks[at(callback)].logical_id}},
                            {"seq", seq},
                            {"instances", in_force.starts}}));
}

}  // namespace

Note since_change(const ReadBack& applied) {
  if (applied.change == 0) return {};
  return note("since-change", {{"change", applied.change}});
}

Note failure_of(const ReadBack& applied) {
  if (applied.error == 0) return {};
  return note("request-failed", {{"error", error_words(applied.error)}, {"errno", applied.error}});
}

void judge_started_otherwise(const RuleContext& context, ThreadIndex index,
                             std::optional<CallbackIndex> callback, const SpecEntry& entry,
                             Judgement& judgement) {
  const auto& model = context.model;
  const auto& thread = model.threads[at(index)];
  const auto own = announcement_of(thread, callback ? &model.callbacks[at(*callback)] : nullptr);
  const auto match = first_match(model, thread, own, entry);
  if (!match) return;
  // Of what was in force before the window's instances the last read-back counts.
  const auto* from = &*match;
  const auto* last = from;
  for (const auto& applied : thread.applied) {
    if (!own.holds(applied) || !is_older(*last, applied)) continue;
    last = &applied;
    if (model.begin && applied.at.time <= *model.begin) from = last;
  }
  if (last != from)
    judgement.needs_none(context.known.read_backs(index, from->at.time, last->at.time));
  if (thread.is_in_force_cut) {
    judgement.unseen(
        evidence("thread_sched", thread.in_force.back().since.at, note("changed-too-often")));
  }
  for (const auto& in_force : all_in_force(model, thread)) {
    const auto& read = in_force.since;
    const bool is_judged = own.holds(read) && !is_older(read, *match);
    if (!is_judged || is_as_specified(read, entry.parameters) != false) continue;
    const auto whose = spec_meanwhile(context, model.processes[at(thread.process)], in_force);
    if (whose == WhoseSpec::another) continue;
    const auto& start = in_force.start;
    const bool is_of_it = start && (!callback || start->callback == *callback);
    if (is_of_it && start->is_certain && whose == WhoseSpec::this_one) {
      judgement.violation(
          [&] {
            return std::vector{what_ran(context, entry, read), what_started(model, in_force)};
          },
          excuses_of(context, index, in_force));
    } else if (in_force.starts != 0) {
      judgement.unseen(what_ran(context, entry, read));
    } else if (callback) {
      judgement.needs({hidden(EventKind::run_start, context.known.scope_of(*callback), read.at.time,
                              in_force.until.value_or(kLatest))});
    }
  }
}

}  // namespace cie::analysis
