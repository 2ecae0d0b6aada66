#include "rate_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "each_subject.hpp"
#include "instance_evidence.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "spec_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

std::optional<Evidence> inexact_releases(const CallbackFacts& callback) {
  // Of an instance that never ended it must be known as well.
  const auto open = callback.has_grid_releases()
                        ? 0
                        : std::ranges::count(callback.open, false, &OpenInstance::release_exact);
  const auto unknown =
      callback.instances - callback.exact_instances + static_cast<std::uint64_t>(open);
  if (unknown == 0) return std::nullopt;
  return evidence(
      "callback_start", callback.starts.first_at,
      note("releases-inexact",
           {{"unknown", unknown}, {"instances", callback.instances + callback.open.size()}}));
}

std::optional<Evidence> unresolved_periods(const CallbackFacts& callback) {
  if (callback.grid.unresolved == 0) return std::nullopt;
  return evidence("callback_start", callback.starts.first_at,
                  note("perhaps-follow-skipped", {{"instances", callback.grid.unresolved}}));
}

// Of an instance that never ended, as the totals say, and the next one was released all the same.
const OpenInstance* released_after(const CallbackFacts& callback) {
  if (!has_unended(callback)) return nullptr;
  const auto found = std::ranges::find_if(
      callback.open, [](const OpenInstance& open) { return open.next_release.has_value(); });
  return found != callback.open.end() ? &*found : nullptr;
}

Note counted_unless(bool is_outside, Note finding) {
  return is_outside ? not_counted(std::move(finding)) : std::move(finding);
}

std::vector<Evidence> released_before_end(const ReleaseBeforeEnd& witness, bool is_outside) {
  return {evidence("callback_end", witness.end, note("instance-ends", {{"seq", witness.seq}})),
          evidence("callback_start", witness.next_start,
                   counted_unless(is_outside,
                                  note("released-before-end", {{"release", witness.next_release.ns},
                                                               {"seq", witness.seq}})))};
}

// The longest response time is no shorter than the shortest inter-arrival time.
std::vector<Evidence> turned_around_late(const Extreme<Duration>& longest, Note response,
                                         const Extreme<Duration>& shortest,
                                         bool is_short_outside = false) {
  auto witnesses = shown_by(longest, std::move(response));
  auto start =
      start_of(shortest, note("shortest-inter-arrival", {{"inter_arrival", shortest.value}}));
  start.note = counted_unless(is_short_outside, std::move(start.note));
  witnesses.push_back(std::move(start));
  return witnesses;
}

void judge_arrival_inside(const CallbackFacts& callback, const std::vector<Conjunction>& excuses,
                          Judgement& judgement) {
  if (!callback.min_inter_arrival || !callback.max_response) return;
  const auto& shortest = *callback.min_inter_arrival;
  const auto& longest = *callback.max_response;
  const Duration error{3 * callback.release_error().ns};  // of three releases
  if (callback.are_releases_certain() && shortest.value + error <= longest.value) {
    judgement.violation(
        turned_around_late(
            longest,
            note("longest-response", {{"response", longest.value}, {"error", error_of(callback)}}),
            shortest),
        excuses);
  } else if (shortest.value <= longest.value + error + callback.release_spread()) {
    judgement.unseen(
        start_of(shortest, note("perhaps-released-before-end", {{"inter_arrival", shortest.value},
                                                                {"response", longest.value},
                                                                {"error", error_of(callback)}})));
  }
}

// What one response time and one inter-arrival time show of which not all are inside.
void judge_arrival_outside(const CallbackFacts& callback, const std::vector<Conjunction>& excuses,
                           Judgement& judgement) {
  if (!callback.outside || judgement.has_witness()) return;
  const auto& outside = *callback.outside;
  if (outside.release_before_end) {
    judgement.violation(released_before_end(*outside.release_before_end, true), excuses);
    return;
  }
  auto shortest = outside.min_inter_arrival;
  auto longest = outside.max_response;
  if (callback.has_grid_releases()) return;  // which are judged inside alone
  const auto& [least, most] = std::tie(callback.min_inter_arrival, callback.max_response);
  const bool is_short_inside = !shortest || (least && least->value < shortest->value);
  const bool is_long_inside = !longest || (most && longest->value < most->value);
  if (is_short_inside) shortest = least;
  if (is_long_inside) longest = most;
  if (!shortest || !longest || longest->value < shortest->value) return;
  judgement.violation(
      turned_around_late(*longest,
                         counted_unless(!is_long_inside, note("longest-response-at-least",
                                                              {{"response", longest->value}})),
                         *shortest, !is_short_inside),
      excuses);
}

// Two events of one waitable (a goal and its cancellation, QoS events) may come at any distance, unless the
// spec says that they do not.
bool is_without_least_arrival(const RuleContext& context, const CallbackFacts& callback,
                              Judgement& judgement) {
  if (callback.kind != CallbackKind::waitable) return false;
  const auto* entry = spec_entry(context, callback);
  if (entry != nullptr && entry->min_inter_arrival_ns) return false;
  judgement.unseen(unknown_entry(context, callback, [](const SpecEntry& one) {
    return one.min_inter_arrival_ns.has_value();
  }));
  return true;
}

std::vector<SubjectVerdict> judge_arrival(const RuleContext& context) {
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (is_without_least_arrival(context, callback, judgement)) return;
        auto excuses = context.known.other_instances(index);
        if (!callback.kind)  // it may be a waitable
          excuses.push_back({hidden(EventKind::registration, context.known.scope_of(index))});
        const auto* hung = released_after(callback);
        const bool is_several =
            callback.instances >= 2 || callback.release_before_end || hung != nullptr;
        judgement.needs(context.known.lost_end(index));
        if (!is_several) {
          judge_arrival_outside(callback, excuses, judgement);
          return;
        }
        judgement.unseen(inexact_releases(callback));
        judgement.unseen(calculated_releases(callback));
        if (callback.min_inter_arrival) judgement.checked(callback.instances);
        if (hung != nullptr) {
          judgement.violation(
              std::vector{evidence("callback_start", hung->start,
                                   note("starts-and-never-ends", {{"seq", hung->seq}})),
                          evidence("callback_start", hung->next_start,
                                   note("next-released", {{"release", hung->next_release->ns}}))},
              {{hidden(EventKind::run_end, context.known.scope_of(index), hung->start.time,
                       hung->next_start.time)}});
          return;
        }
        if (callback.release_before_end) {
          judgement.violation(released_before_end(*callback.release_before_end, false), excuses);
          return;
        }
        judge_arrival_inside(callback, excuses, judgement);
        judge_arrival_outside(callback, excuses, judgement);
      });
}

// More periods were skipped than allowed, before whosever runs. `may_be_more`: than are known.
void judge_skipped(const CallbackFacts& callback, std::uint64_t allowed, bool may_be_more,
                   Judgement& judgement) {
  const auto in_all = [&](std::uint64_t missed) {
    return note(may_be_more ? "periods-skipped-at-least" : "periods-skipped",
                {{"periods", missed}, {"allowed", allowed}});
  };
  const auto accuse = [&](std::uint64_t missed, const auto& first) {
    std::vector<Evidence> witnesses;
    if (first) {
      witnesses.push_back(
          start_of(*first, note("periods-skipped-before", {{"periods", first->value}})));
    }
    witnesses.push_back(evidence("callback_start", callback.starts.last_at, in_all(missed)));
    judgement.violation(std::move(witnesses));
  };
  const auto& own = callback.own;
  if (!own) {
    accuse(callback.missed, callback.first_missed);
  } else if (own->missed > allowed) {
    accuse(own->missed, own->first_missed);
  } else {
    doubt_others(callback, in_all(callback.missed), judgement);
  }
}

std::vector<SubjectVerdict> judge_missed(const RuleContext& context) {
  return judge_callbacks(context, [&context](CallbackIndex index, const CallbackFacts& callback,
                                             Judgement& judgement) {
    if (callback.kind && callback.kind != CallbackKind::timer) return;
    judgement.unseen(unknown_entry(context, callback, [](const SpecEntry& entry) {
      return entry.missed_releases_allowed.value_or(0) > 0;
    }));
    if (!callback.kind) return;
    const auto allowed = most_allowed(context, callback, &SpecEntry::missed_releases_allowed);
    judgement.checked(callback.starts.count);
    const auto lost = context.known.lost_run(index);
    judgement.needs(lost);
    judgement.unseen(calculated_releases(callback));
    const auto unknown =
        callback.has_grid_releases() ? unresolved_periods(callback) : inexact_releases(callback);
    if (callback.missed > allowed && !callback.are_releases_certain()) {
      judgement.unseen(evidence("callback_start", callback.starts.last_at,
                                note("periods-skipped-unless-reset",
                                     {{"periods", callback.missed}, {"allowed", allowed}})));
    } else if (callback.missed > allowed) {
      const bool may_be_more = unknown || context.known.may_be_hidden(lost);
      judge_skipped(callback, allowed, may_be_more, judgement);
    }
    judgement.unseen(unknown);
  });
}

std::vector<SubjectVerdict> judge_rate(const RuleContext& context) {
  constexpr EntryQuestion kAsks = [](const SpecEntry& entry) {
    return entry.min_inter_arrival_ns || entry.max_inter_arrival_ns;
  };
  const bool is_any_specified = specifies_any(context, kAsks);
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (is_any_specified) judgement.unseen(unknown_entry(context, callback, kAsks));
        const auto* entry = spec_entry(context, callback);
        if (entry == nullptr) return;
        const auto& min = entry->min_inter_arrival_ns;
        const auto& max = entry->max_inter_arrival_ns;
        if (!min && !max) return;
        // Before an instance that never ended, too.
        const std::uint64_t judged = callback.min_inter_arrival ? 1 : 0;
        judgement.checked(std::max(callback.inter_arrival.count(), judged));
        judgement.needs(context.known.lost_end(index));
        const auto excuses = context.known.other_instances(index);
        if (callback.instances >= 2) {
          judgement.unseen(inexact_releases(callback));
          judgement.unseen(calculated_releases(callback));
        }
        if (callback.is_reordered) {  // then others may lie between two that are far apart
          judgement.unseen(
              evidence("callback_start", callback.starts.last_at, note("instances-reordered")));
        }
        const auto error = 2 * callback.release_error().ns;  // of two releases
        constexpr std::string_view kTooSoon = "released-too-soon";
        constexpr std::string_view kTooLate = "released-too-late";
        const auto hold = [&](const Extreme<Duration>& extreme, std::string_view code,
                              std::int64_t bound, std::int64_t excess, bool is_certain,
                              bool is_outside = false) {
          if (excess + error <= 0) return;
          auto witness = start_of(extreme, note(code, {{"inter_arrival", extreme.value},
                                                       {"spec", place(context, entry->line)},
                                                       {"declared", Duration{bound}},
                                                       {"error", error_of(callback)}}));
          witness.note = counted_unless(is_outside, std::move(witness.note));
          if (is_certain && callback.are_releases_certain() && excess > error) {
            judgement.violation(std::vector{std::move(witness)}, excuses);
          } else {
            judgement.unseen(std::move(witness));
          }
        };
        if (min && callback.min_inter_arrival) {
          const auto& shortest = *callback.min_inter_arrival;
          hold(shortest, kTooSoon, *min, *min - shortest.value.ns, true);
        }
        if (max && callback.max_inter_arrival) {
          const auto& longest = *callback.max_inter_arrival;
          hold(longest, kTooLate, *max, longest.value.ns - *max, !callback.is_reordered);
        }
        if (!callback.outside || judgement.has_witness()) return;
        const auto& outside = *callback.outside;
        if (const auto& shortest = outside.min_inter_arrival; min && shortest)
          hold(*shortest, kTooSoon, *min, *min - shortest->value.ns, true, true);
        if (const auto& longest = outside.max_inter_arrival; max && longest) {
          const bool is_reordered = callback.is_reordered || outside.is_reordered;
          hold(*longest, kTooLate, *max, longest->value.ns - *max, !is_reordered, true);
        }
      });
}

}  // namespace

const Rule kArrivalExceedsTurnaround{
    .id = kArrivalExceedsTurnaroundRule,
    .name = "arrival-exceeds-turnaround",
    .meaning =
        "Each instance ends before the next one is released: the shortest inter-arrival time "
        "exceeds the longest response time. Fewer than two instances are not judged, nor is a "
        "waitable (an action, an event of QoS) for which the spec declares no min_inter_arrival: "
        "its events may come at any distance. One that never ended was released as well: that "
        "counts, and so does the release after it.",
    .why_it_matters =
        "This is the assumption under which one thread per callback needs no queue: when it does "
        "not hold, instances wait for the one before them and delays add up.",
    .inconclusive_when = "releases are not known exactly, or instances were lost.",
    .remedy =
        "shorten the callback, raise its priority or give it a CPU, or let it be released less "
        "often: a timer with a longer period, anything else by a slower source; cie report shows "
        "where the time went.",
    .violation = "overran the next release",
    .main_evidence = 1,
    .judge = judge_arrival,
    .needs = {.instances = true}};

const Rule kNoMissedRelease{
    .id = kNoMissedReleaseRule,
    .name = "no-missed-release",
    .meaning =
        "A timer skips no more periods in a run than missed_releases_allowed says (0 by default), "
        "those before an instance that was still open included. Time goes on while nobody spins.",
    .why_it_matters =
        "Every skipped period is an activation that the design counts on and that never happened.",
    .inconclusive_when =
        "expiries are neither recorded nor, with ROS 2's timers, follow from when the timer was "
        "made, or instances were lost.",
    .remedy =
        "find what kept the thread from running or the instance from ending (cie report: "
        "preempted, blocked, wake delay); reset a timer after a pause that is meant; allow in the "
        "spec what the design can bear.",
    .violation = "skipped periods",
    .judge = judge_missed,
    .needs = {.instances = true}};

const Rule kRate{
    .id = "R5",
    .name = "rate",
    .meaning =
        "Inter-arrival times lie between min_inter_arrival and max_inter_arrival. Only "
        "consecutive instances are compared, those that never ended as well.",
    .why_it_matters =
        "Sources that send faster than declared overload everything behind them; slower ones "
        "starve it.",
    .inconclusive_when =
        "releases are not known exactly, instances started in another order than they were "
        "released in, or instances were lost.",
    .remedy =
        "correct the source's rate, limit it, or declare what it really is and analyze again.",
    .violation = "did not keep the rate",
    .judge = judge_rate,
    .needs = {.instances = true, .spec = true}};

}  // namespace cie::analysis
