#include "restart_rule.hpp"

#include "judgement.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

namespace cie::analysis {
namespace {

struct Lifetime {
  CallbackIndex index{};
  Timestamp begin;
  Timestamp end;
};

Lifetime lifetime_of(const Model& model, CallbackIndex index) {
  const auto& callback = model.callbacks[at(index)];
  const auto& process = model.processes[at(callback.process)];
  const auto begin =
      callback.registered ? callback.registered->time : callback.starts.first_at.time;
  auto end = begin;
  if (callback.fini) {
    end = std::max(end, callback.fini->at.time);
  } else if (process.last_seen) {
    end = std::max(end, process.last_seen->time);
  }
  return {.index = index, .begin = begin, .end = end};
}

// The last of a callback's threads that has a read-back of what was applied.
std::optional<ThreadIndex> configured_thread(const Model& model,
                                             const std::vector<ThreadIndex>& threads) {
  std::optional<ThreadIndex> found;
  for (const auto index : threads) {
    if (last_applied(model, model.threads[at(index)]) != nullptr) found = index;
  }
  return found;
}

std::string properties(const CallbackFacts& callback) {
  std::string text = callback.kind ? std::string(label(*callback.kind)) : "unknown kind";
  if (!callback.source.empty()) text += " of " + callback.source;
  text += ", period " + std::to_string(callback.period_ns) + " ns";
  return text += ", deadline " + std::to_string(callback.deadline_ns) + " ns";
}

void compare_properties(const CallbackFacts& before, const CallbackFacts& after,
                        Judgement& judgement) {
  const auto key = [](const CallbackFacts& c) {
    return std::tie(c.kind, c.source, c.period_ns, c.deadline_ns);
  };
  if (key(before) == key(after)) return;
  judgement.fail(evidence("callback_init", *before.registered, "was: " + properties(before)));
  judgement.fail(evidence("callback_init", *after.registered, "is: " + properties(after)));
}

void compare_parameters(const RuleContext& context, const CallbackFacts& before,
                        const CallbackFacts& after, Judgement& judgement) {
  const auto& model = context.model;
  const auto& proof = context.proof;
  const auto read_back = [&](const CallbackFacts& callback) -> const ReadBack* {
    const auto threads = context.isolated.of(callback);
    const auto index = configured_thread(model, threads);
    if (!index) {
      for (const auto other : threads)
        judgement.overrule(proof.loss(other));
      for (const auto* pair : callback.ran_on) {  // perhaps its own, announced unseen
        if (!model.threads[at(pair->thread)].announced) judgement.doubt(proof.loss(pair->thread));
      }
      return nullptr;
    }
    const auto* applied = last_applied(model, model.threads[at(*index)]);
    if (proof.may_hide_read_back(*index, applied->n, std::nullopt)) {
      judgement.overrule(proof.loss(*index));
    }
    return applied;
  };
  const auto* was = read_back(before);
  const auto* is = read_back(after);
  if ((was == nullptr) != (is == nullptr)) {
    judgement.doubt(evidence("thread_sched", *(is == nullptr ? after : before).registered,
                             "what its thread ran as in this lifetime is unknown"));
  }
  if (was == nullptr || is == nullptr || is_same_parameters(*was, *is)) return;
  judgement.fail(evidence("thread_sched", was->at, "was: " + describe(*was)));
  judgement.fail(evidence("thread_sched", is->at, "is: " + describe(*is)));
}

std::vector<SubjectVerdict> judge_restart(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  std::map<std::pair<HostIndex, std::string_view>, std::vector<Lifetime>> by_id;
  std::vector<Lifetime> unknown;
  for (const auto index : context.callbacks) {
    const auto& callback = model.callbacks[at(index)];
    const auto life = lifetime_of(model, index);
    if (callback.registered) {
      by_id[{model.processes[at(callback.process)].host, callback.logical_id}].push_back(life);
    } else {
      unknown.push_back(life);
    }
  }
  std::vector<SubjectVerdict> verdicts;
  struct Ends {                              // on one host; times of several have nothing in common
    std::optional<Timestamp> first;          // of any lifetime: who begins later may be a restart
    std::optional<Timestamp> first_unknown;  // of one that may have had any id
  };
  std::map<HostIndex, Ends> ends;
  const auto host_of = [&model](const Lifetime& life) {
    return model.processes[at(model.callbacks[at(life.index)].process)].host;
  };
  for (const auto& life : unknown) {
    auto& [first_end, first_unknown_end] = ends[host_of(life)];
    first_end = first_unknown_end = first_end ? std::min(*first_end, life.end) : life.end;
  }
  for (auto& [key, lives] : by_id) {
    auto& [first_end, first_unknown_end] = ends[key.first];
    std::ranges::stable_sort(lives, {},
                             [](const Lifetime& life) { return std::tuple(life.begin, life.end); });
    for (std::size_t i = 0; i < lives.size(); ++i) {
      first_end = first_end ? std::min(*first_end, lives[i].end) : lives[i].end;
      if (i == 0 && first_unknown_end && *first_unknown_end < lives[i].begin) {
        Judgement judgement(names.callback(lives[i].index));
        judgement.doubt(evidence("callback_init", moment(*first_unknown_end),
                                 "a callback whose logical id is unknown ended here: it may have "
                                 "been the same one"));
        conclude(std::move(judgement), verdicts);
      }
      if (i == 0 || lives[i - 1].end > lives[i].begin) continue;
      const auto& before = model.callbacks[at(lives[i - 1].index)];
      const auto& after = model.callbacks[at(lives[i].index)];
      Judgement judgement(names.callback(lives[i].index));
      judgement.check();
      compare_properties(before, after, judgement);
      compare_parameters(context, before, after, judgement);
      conclude(std::move(judgement), verdicts);
    }
  }
  for (const auto& life : unknown) {
    const auto& first_end = ends[host_of(life)].first;
    if (!first_end || life.begin <= *first_end) continue;
    Judgement judgement(names.callback(life.index));
    judgement.doubt(evidence("callback_init", model.callbacks[at(life.index)].starts.first_at,
                             "its logical id is unknown, so it cannot be compared with the "
                             "callbacks of the process before"));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

const Rule kMappingSurvivesRestart{
    "M5", "mapping-survives-restart",
    "When a process is restarted, each callback returns as it was: same kind, source, period "
    "and deadline, and its thread with the same policy, priority or nice value, deadline triple "
    "and CPUs. Each lifetime is compared with the one before it.\n"
    "Why it matters: Configurators that address threads by tid lose their setting at a restart, "
    "and nobody notices.\n"
    "Inconclusive when a logical id, or the last parameters of one of the lifetimes, were lost.\n"
    "Remedy: let the application apply the spec itself at every start; make ids and parameters "
    "depend on nothing that changes between starts.",
    judge_restart};

}  // namespace cie::analysis
