#include "restart_rule.hpp"

#include <cie/analysis/note.hpp>
#include <cie/tracepoints/schema.hpp>

#include "callback_doubts.hpp"
#include "judgement.hpp"
#include "lifetime_parameters.hpp"
#include "model/callback_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

struct Lifetime {
  CallbackIndex index{};
  Timestamp begin;
  Timestamp end;
};

Lifetime lifetime_of(const RuleContext& context, CallbackIndex index) {
  const auto& model = context.model;
  const auto& callback = model.callbacks[at(index)];
  const auto& process = model.processes[at(callback.process)];
  auto begin = callback.registered ? callback.registered->time : callback.starts.first_at.time;
  // It may have been registered long before it was announced.
  const bool is_announced =
      callback.registered ? callback.may_repeat : process.first_moment == RunMoment::announce;
  if (is_announced) begin = std::min(begin, latest_begin(process));
  auto end = begin;
  if (callback.fini) {
    end = std::max(end, callback.fini->at.time);
  } else {
    end = std::max(end, context.lives.last_sign(callback.process));
  }
  return {.index = index, .begin = begin, .end = end};
}

Note properties(const CallbackFacts& callback) {
  auto source = callback.source.empty() ? Note{} : note("of-source", {{"source", callback.source}});
  auto deadline =
      !callback.is_accounted  // no event of ROS 2 tells a deadline
          ? Note{}
          : note("and-deadline", {{"deadline", Duration{signed_ns(callback.deadline_ns)}}});
  return note("callback-properties", {callback.kind ? Argument{"kind", label(*callback.kind)}
                                                    : Argument{"kind", note("unknown-kind")},
                                      {"source", std::move(source)},
                                      {"period", Duration{signed_ns(callback.period_ns)}},
                                      {"deadline", std::move(deadline)}});
}

void compare_properties(const CallbackFacts& before, const CallbackFacts& after,
                        const std::vector<Evidence>& beside, Judgement& judgement) {
  const auto key = [](const CallbackFacts& c) { return std::tie(c.kind, c.source, c.period_ns); };
  const bool are_deadlines_told = before.is_accounted && after.is_accounted;
  if (before.is_accounted != after.is_accounted) {
    judgement.unseen(
        registered_as(before.is_accounted ? after : before, note("ros2-tells-no-deadline")));
  }
  const bool is_as_before =
      key(before) == key(after) && (!are_deadlines_told || before.deadline_ns == after.deadline_ns);
  if (is_as_before) return;
  judgement.violation_unless(
      beside, {registered_as(before, note("lifetime-was", {{"properties", properties(before)}})),
               registered_as(after, note("lifetime-is", {{"properties", properties(after)}}))});
}

// Lifetimes of one id by their ends, each with the latest begin among those up to it.
struct Ended {
  Lifetime life;
  Timestamp latest_begin;
};

std::vector<Ended> in_order_of_ends(const std::vector<Lifetime>& lives) {
  std::vector<Ended> ended;
  ended.reserve(lives.size());
  for (const auto& life : lives)
    ended.push_back({.life = life, .latest_begin = life.begin});
  std::ranges::stable_sort(
      ended, {}, [](const Ended& one) { return std::tuple(one.life.end, one.life.begin); });
  for (std::size_t i = 1; i < ended.size(); ++i) {
    ended[i].latest_begin = std::max(ended[i].latest_begin, ended[i - 1].latest_begin);
  }
  return ended;
}

// The last ones that had ended when this one began: several, if they lived at the same time.
std::vector<CallbackIndex> predecessors(const std::vector<Ended>& by_end, const Lifetime& life) {
  auto next = std::ranges::upper_bound(by_end, life.begin, {},
                                       [](const Ended& one) { return one.life.end; });
  const auto is_itself = [&life](const Ended& one) { return one.life.index == life.index; };
  if (next != by_end.begin() && is_itself(*std::prev(next))) --next;  // it was no longer than that
  std::vector<CallbackIndex> found;
  if (next == by_end.begin()) return found;
  const auto latest_begin = std::prev(next)->latest_begin;
  while (next != by_end.begin() && std::prev(next)->life.end >= latest_begin) {
    --next;
    if (!is_itself(*next)) found.push_back(next->life.index);
  }
  std::ranges::reverse(found);
  return found;
}

std::optional<Timestamp> last_end(const RuleContext& context,
                                  const std::vector<CallbackIndex>& callbacks) {
  std::optional<Timestamp> last;
  for (const auto index : callbacks) {
    const auto end = lifetime_of(context, index).end;
    last = std::max(last.value_or(end), end);
  }
  return last;
}

// One that misses two periods of its clocks while another one of the same trace goes on has ended, if
// nothing was lost.
bool is_silent_beside(const RuleContext& context, ProcessIndex index, ProcessIndex other) {
  constexpr Duration kSilence{2 * kClockSyncPeriod.count()};
  const auto& model = context.model;
  const auto& process = model.processes[at(index)];
  const auto trace_of = [&model](const ProcessFacts& of) -> std::optional<std::uint32_t> {
    const auto stream = of.first_seen.value_or(EventRef{}).stream;
    if (at(stream) >= model.streams.size()) return std::nullopt;
    return model.streams[at(stream)].trace;
  };
  const auto trace = trace_of(process);
  if (!process.run_begin || !trace || trace != trace_of(model.processes[at(other)])) return false;
  const auto last = context.lives.last_sign(index);
  const auto until = context.lives.last_sign(other);
  return until - last > kSilence && !context.user_losses.between(index, last, until);
}

// Why it may have lived on beside the later one, as far as is known.
std::optional<Evidence> untold_end(const RuleContext& context, const CallbackFacts& before,
                                   const CallbackFacts& after) {
  const auto& process = context.model.processes[at(before.process)];
  const auto& other = context.model.processes[at(after.process)];
  const bool is_pid_given_anew = process.told_pid == other.told_pid &&
                                 process.pid_ns == other.pid_ns && !process.shares_pid_since &&
                                 before.process != after.process;
  if (before.fini || process.run_end || context.lives.has_exited(before.process) ||
      is_pid_given_anew || is_silent_beside(context, before.process, after.process))
    return std::nullopt;
  return without_event(moment(context.lives.last_sign(before.process)),
                       note("process-perhaps-lived-on"));
}

// Why it may have lived beside the earlier one, as far as is known: its callback_init may repeat what is
// older, where the run_begin of an announcement is missing.
std::optional<Evidence> untold_begin(const RuleContext& context, const CallbackFacts& after) {
  if (!after.registered || after.may_repeat || registration(context, after)) return std::nullopt;
  return evidence("callback_init", *after.registered, note("perhaps-announced-only"));
}

// A process with another lifetime of it may have come between the two, and all it told be lost.
std::optional<Evidence> unseen_lifetime(const RuleContext& context, CallbackIndex before,
                                        const Lifetime& after) {
  const auto process = context.model.callbacks[at(before)].process;
  return context.user_losses.unseen_process(context.model.processes[at(process)].host,
                                            lifetime_of(context, before).end, after.begin);
}

// Of several predecessors that differ nobody knows which one it follows.
void conclude_restart(const RuleContext& context, const std::vector<CallbackIndex>& before,
                      const Lifetime& life, std::vector<SubjectVerdict>& verdicts) {
  const auto& model = context.model;
  const auto& after = model.callbacks[at(life.index)];
  std::vector<SubjectVerdict> compared;
  for (const auto index : before) {
    Judgement judgement(context.names.callback(life.index), context.known);
    judgement.checked();
    // Why they may have lived side by side.
    const auto beside = listed(
        {untold_end(context, model.callbacks[at(index)], after), untold_begin(context, after)});
    compare_properties(model.callbacks[at(index)], after, beside, judgement);
    compare_parameters(context, index, life.index, beside, judgement);
    judgement.unseen(unseen_lifetime(context, index, life));
    conclude(std::move(judgement), compared);
  }
  const auto is_alike = [&compared](const SubjectVerdict& verdict) {
    return verdict.verdict == compared.front().verdict;
  };
  if (std::ranges::all_of(compared, is_alike)) {
    verdicts.push_back(std::move(compared.front()));
    return;
  }
  Judgement judgement(context.names.callback(life.index), context.known);
  judgement.checked();
  judgement.unseen(
      registered_as(after, note("followed-lifetime-unknown", {{"lifetimes", before.size()}})));
  conclude(std::move(judgement), verdicts);
}

// Of those that began before it, the last of its own process, if that may have ended before it began:
// its end was not seen, nor that it lived on. Null: there is none.
const CallbackFacts* perhaps_ended(const Model& model, const std::vector<Lifetime>& lives,
                                   std::size_t place) {
  const auto callback_of = [&model](const Lifetime& life) -> const CallbackFacts& {
    return model.callbacks[at(life.index)];
  };
  const auto& after = callback_of(lives[place]);
  for (auto earlier = place; earlier-- > 0;) {
    const auto& before = callback_of(lives[earlier]);
    if (before.process != after.process) continue;
    const bool is_unknown = !before.fini && last_sign(before).time < after.registered->time;
    return is_unknown ? &before : nullptr;
  }
  return nullptr;
}

// Ends of one id's lifetimes that callback_fini tells, in order.
using ToldEnds = std::map<ProcessIndex, std::vector<Timestamp>>;

ToldEnds told_ends(const Model& model, const std::vector<Ended>& by_end) {
  ToldEnds ends;
  for (const auto& one : by_end) {
    const auto& callback = model.callbacks[at(one.life.index)];
    if (callback.fini) ends[callback.process].push_back(callback.fini->at.time);
  }
  return ends;
}

// An announcement told of it after another one of its process had ended: it may be the next lifetime,
// whose own callback_init was lost, and may have lived beside that one.
bool may_follow_unseen(const CallbackFacts& after, const Lifetime& life, const ToldEnds& ends) {
  if (!after.registered || !after.may_repeat) return false;
  const auto of_process = ends.find(after.process);
  if (of_process == ends.end()) return false;
  const auto end = std::ranges::upper_bound(of_process->second, life.begin);
  return end != of_process->second.end() && *end < after.registered->time;
}

// Lifetimes that may have had any id, of one host.
class UnknownLives {
 public:
  void add(const Lifetime& life) { lives_.push_back(life); }
  void sort() {
    std::ranges::sort(lives_, {}, [](const Lifetime& life) {
      return std::tuple(life.begin, life.end, life.index);
    });
    first_end_.assign(lives_.size(), nullptr);
    const Lifetime* first = nullptr;
    for (auto i = lives_.size(); i-- > 0;) {
      if (first == nullptr || lives_[i].end < first->end) first = &lives_[i];
      first_end_[i] = first;
    }
  }
  // One that began and ended there; null: none did.
  const Lifetime* between(Timestamp after, Timestamp before) const {
    const auto next = std::ranges::upper_bound(lives_, after, {}, &Lifetime::begin);
    if (next == lives_.end()) return nullptr;
    const auto* found = first_end_[static_cast<std::size_t>(next - lives_.begin())];
    return found->end < before ? found : nullptr;
  }

 private:
  std::vector<Lifetime> lives_;             // by their begin
  std::vector<const Lifetime*> first_end_;  // of those from there on the one that ends first
};

std::vector<SubjectVerdict> judge_restart(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  std::map<std::pair<HostIndex, std::string_view>, std::vector<Lifetime>> by_id;
  std::vector<Lifetime> unknown;
  for (const auto index : context.callbacks) {
    const auto& callback = model.callbacks[at(index)];
    if (context.is_after_window(callback)) continue;
    const auto life = lifetime_of(context, index);
    if (is_identified(callback)) {
      by_id[{model.processes[at(callback.process)].host, callback.logical_id}].push_back(life);
    } else {
      unknown.push_back(life);
    }
  }
  std::vector<SubjectVerdict> verdicts;
  struct Ends {                      // on one host; times of several have nothing in common
    std::optional<Timestamp> first;  // of any lifetime: who begins later may be a restart
    UnknownLives unknown;
  };
  std::map<HostIndex, Ends> ends;
  const auto host_of = [&model](const Lifetime& life) {
    return model.processes[at(model.callbacks[at(life.index)].process)].host;
  };
  for (const auto& life : unknown) {
    auto& of_host = ends[host_of(life)];
    of_host.first = of_host.first ? std::min(*of_host.first, life.end) : life.end;
    of_host.unknown.add(life);
  }
  for (auto& [host, of_host] : ends)
    of_host.unknown.sort();
  for (auto& [key, lives] : by_id) {
    auto& [first_end, unknown_lives] = ends[key.first];
    std::ranges::stable_sort(lives, {},
                             [](const Lifetime& life) { return std::tuple(life.begin, life.end); });
    const auto ends_told = told_ends(model, in_order_of_ends(lives));
    auto that_ran = lives;  // another one tells nothing of how the callback returned
    std::erase_if(that_ran, [&](const Lifetime& life) {
      return has_never_run(context, model.callbacks[at(life.index)]);
    });
    const auto by_end = in_order_of_ends(that_ran);
    for (std::size_t i = 0; i < lives.size(); ++i) {
      first_end = first_end ? std::min(*first_end, lives[i].end) : lives[i].end;
      constexpr Timestamp kEver{std::numeric_limits<std::int64_t>::min()};
      const auto* const earlier = i == 0 ? unknown_lives.between(kEver, lives[i].begin) : nullptr;
      if (earlier != nullptr) {
        Judgement judgement(names.callback(lives[i].index), context.known);
        judgement.unseen(without_event(moment(earlier->end), note("same-perhaps-ended-here")));
        conclude(std::move(judgement), verdicts);
      }
      const auto before = predecessors(by_end, lives[i]);
      const auto ended = last_end(context, before);
      const auto* const between = ended ? unknown_lives.between(*ended, lives[i].begin) : nullptr;
      if (between != nullptr) {
        Judgement judgement(names.callback(lives[i].index), context.known);
        judgement.unseen(without_event(first_sign(model, model.callbacks[at(between->index)]),
                                       note("same-perhaps-lived-between")));
        conclude(std::move(judgement), verdicts);
      } else if (!before.empty()) {
        conclude_restart(context, before, lives[i], verdicts);
      }
      const auto& after = model.callbacks[at(lives[i].index)];
      if (may_follow_unseen(after, lives[i], ends_told)) {
        Judgement judgement(names.callback(lives[i].index), context.known);
        judgement.unseen(registered_as(after, note("announced-after-end-of-former")));
        conclude(std::move(judgement), verdicts);
      }
      const auto* const open = perhaps_ended(model, lives, i);
      if (before.empty() && open != nullptr) {
        Judgement judgement(names.callback(lives[i].index), context.known);
        judgement.unseen(without_event(last_sign(*open), note("end-of-former-unseen")));
        conclude(std::move(judgement), verdicts);
      }
    }
  }
  for (const auto& life : unknown) {
    const auto& first_end = ends[host_of(life)].first;
    if (!first_end || life.begin <= *first_end) continue;
    Judgement judgement(names.callback(life.index), context.known);
    judgement.unseen(without_event(first_sign(model, model.callbacks[at(life.index)]),
                                   note("not-compared-without-logical-id")));
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

const Rule kMappingSurvivesRestart{
    .id = "M5",
    .name = "mapping-survives-restart",
    .meaning =
        "When a process is restarted, each callback returns as it was: same kind, source, period "
        "and deadline, and its thread with the same policy, priority or nice value, deadline "
        "triple and CPUs, as they were applied last. Of a callback without a thread of its own, as "
        "in a pool, those of all threads that ran it are compared: the same in both lifetimes, or "
        "none that is in both. Each lifetime is compared with the last one "
        "before it that ran or was read back; of several that lived at the same time before, it must be like each or like "
        "none to be judged.",
    .why_it_matters =
        "Configurators that address threads by tid lose their setting at a restart, and nobody "
        "notices.",
    .inconclusive_when =
        "a logical id, or the last parameters of one of the lifetimes, were lost or are not told "
        "(ROS 2, which tells no deadline either), when it ran in a pool whose threads have "
        "different parameters and some of them are those of both lifetimes, when the later one was announced only, after "
        "the other had ended, and when they differ and the earlier process was not seen to end: "
        "it may have lived on; and when so many events were lost between the two that another "
        "lifetime may be among them.",
    .remedy =
        "let the application apply the spec itself at every start; make ids and parameters depend "
        "on nothing that changes between starts.",
    .violation = "changed after a restart",
    .judge = judge_restart};

}  // namespace cie::analysis
