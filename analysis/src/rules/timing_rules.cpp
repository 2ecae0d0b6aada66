#include "timing_rules.hpp"

#include <cie/analysis/deadline.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "spec_questions.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

// judge(callback, why instances of it may be missing, judgement).
template <typename Judge>
std::vector<SubjectVerdict> for_each_callback(const RuleContext& context, const Judge& judge) {
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        judge(callback, context.proof.loss(index), judgement);
      });
}

template <typename Value>
Evidence start_of(const Extreme<Value>& extreme, const std::string& note) {
  return evidence("callback_start", extreme.start, "seq " + std::to_string(extreme.seq) + note);
}

// The instance that an extreme was taken from: its start and its end.
void fail_with(const Extreme<Duration>& extreme, const std::string& what, Judgement& judgement) {
  const auto released =
      extreme.release ? ", released at " + std::to_string(extreme.release->ns) : std::string();
  judgement.fail(start_of(extreme, " starts" + released));
  judgement.fail(evidence(extreme.end ? "callback_end" : "callback_start",
                          extreme.end.value_or(extreme.start), what));
}

std::optional<Evidence> inexact_releases(const CallbackFacts& callback) {
  // Of an instance that never ended it must be known as well.
  const auto open = callback.has_grid_releases()
                        ? 0
                        : std::ranges::count(callback.open, false, &OpenInstance::release_exact);
  const auto unknown =
      callback.instances - callback.exact_instances + static_cast<std::uint64_t>(open);
  if (unknown == 0) return std::nullopt;
  return evidence("callback_start", callback.starts.first_at,
                  "the release of " + std::to_string(unknown) + " of " +
                      std::to_string(callback.instances + callback.open.size()) +
                      " instances is not known exactly");
}

std::optional<Evidence> unresolved_periods(const CallbackFacts& callback) {
  if (callback.grid.unresolved == 0) return std::nullopt;
  return evidence("callback_start", callback.starts.first_at,
                  "whether periods were skipped before " +
                      counted(callback.grid.unresolved, "instance") + " is not known");
}

// Whether a timer was reset nobody tells.
std::optional<Evidence> calculated_releases(const CallbackFacts& callback) {
  if (callback.are_releases_certain()) return std::nullopt;
  return evidence("callback_start", callback.starts.last_at,
                  "releases are calculated from when the timer was made; it may have been reset");
}

std::string error_of(const CallbackFacts& callback) {
  if (!callback.has_grid_releases()) return {};
  const auto spread = callback.release_spread();
  const auto earlier = spread.ns > 0 ? "; released up to " + nanoseconds(spread) +
                                           " earlier yet if the thread was preempted as rcl made "
                                           "the timer"
                                     : std::string();
  return " (calculated, to " + nanoseconds(callback.release_error()) + earlier + ')';
}

// Where more ended than started, an instance ended twice. If an end was lost it may have been the
// first one, and an instance that seems too long was not.
std::optional<Evidence> doubtful_ends(const CallbackFacts& callback,
                                      const std::optional<Evidence>& loss) {
  const auto& fini = callback.fini;
  const bool is_any_end_lost = fini && callback.ended.count < fini->ended;
  return is_any_end_lost && fini->ended > fini->started ? loss : std::nullopt;
}

// What violates a rule only by instances that may be another callback's.
void doubt_others(const CallbackFacts& callback, const std::string& finding, Judgement& judgement) {
  judgement.doubt(
      evidence("callback_start", callback.own->others_since,
               "from here on an instance " + std::string(kPerhapsAnothers) + "; " + finding));
}

// Of an instance that never ended, as the totals say, and the next one was released all the same.
const OpenInstance* released_after(const CallbackFacts& callback) {
  if (!has_unended(callback)) return nullptr;
  const auto found = std::ranges::find_if(
      callback.open, [](const OpenInstance& open) { return open.next_release.has_value(); });
  return found != callback.open.end() ? &*found : nullptr;
}

std::vector<SubjectVerdict> judge_arrival(const RuleContext& context) {
  return for_each_callback(context, [](const CallbackFacts& callback,
                                       const std::optional<Evidence>& loss, Judgement& judgement) {
    const auto* hung = released_after(callback);
    const bool is_several =
        callback.instances >= 2 || callback.release_before_end || hung != nullptr;
    if (!is_several && !loss) return;
    judgement.overrule(loss);
    judgement.doubt(inexact_releases(callback));
    judgement.doubt(calculated_releases(callback));
    if (callback.min_inter_arrival) judgement.check(callback.instances);
    if (hung != nullptr) {
      const auto seq = "seq " + std::to_string(hung->seq);
      judgement.fail(evidence("callback_start", hung->start, seq + " starts and never ends"));
      judgement.fail(
          evidence("callback_start", hung->next_start,
                   "the next instance was released at " + std::to_string(hung->next_release->ns)));
      return;
    }
    if (callback.release_before_end) {
      const auto& witness = *callback.release_before_end;
      const auto seq = "seq " + std::to_string(witness.seq);
      judgement.fail(evidence("callback_end", witness.end, seq + " ends"));
      judgement.fail(evidence("callback_start", witness.next_start,
                              "the next instance was released at " +
                                  std::to_string(witness.next_release.ns) +
                                  ", not after the end of " + seq));
      return;
    }
    if (!callback.min_inter_arrival || !callback.max_response) return;
    const auto& shortest = *callback.min_inter_arrival;
    const auto& longest = *callback.max_response;
    const Duration error{3 * callback.release_error().ns};  // of three releases
    if (callback.are_releases_certain() && shortest.value + error <= longest.value) {
      fail_with(longest,
                "longest response time: " + nanoseconds(longest.value) + error_of(callback),
                judgement);
      judgement.fail(
          start_of(shortest, " was released " + nanoseconds(shortest.value) +
                                 " after the one before it: shortest inter-arrival time"));
    } else if (shortest.value <= longest.value + error + callback.release_spread()) {
      judgement.doubt(
          start_of(shortest, " was released " + nanoseconds(shortest.value) +
                                 " after the one before it; the longest response time is " +
                                 nanoseconds(longest.value) + error_of(callback)));
    }
  });
}

// More periods were skipped than allowed, before whosever runs.
void judge_skipped(const CallbackFacts& callback, std::uint64_t allowed, Judgement& judgement) {
  const auto in_all = [allowed](std::uint64_t missed) {
    return counted(missed, "period") + " skipped in all, " + std::to_string(allowed) + " allowed";
  };
  const auto accuse = [&](std::uint64_t missed, const auto& first) {
    if (first) {
      judgement.fail(start_of(*first, ": " + counted(first->value, "period") +
                                          (first->value == 1 ? " was" : " were") +
                                          " skipped before this release"));
    }
    judgement.fail(evidence("callback_start", callback.starts.last_at, in_all(missed)));
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
    judgement.doubt(unknown_entry(context, callback));
    if (callback.kind != CallbackKind::timer) return;
    const auto allowed = most_allowed(context, callback, &SpecEntry::missed_releases_allowed);
    judgement.check(callback.starts.count);
    judgement.doubt(context.proof.lost_runs(index));
    judgement.doubt(calculated_releases(callback));
    if (callback.missed > allowed && !callback.are_releases_certain()) {
      judgement.doubt(evidence("callback_start", callback.starts.last_at,
                               counted(callback.missed, "period") +
                                   " skipped in all, if the timer was not reset; " +
                                   std::to_string(allowed) + " allowed"));
    } else if (callback.missed > allowed) {
      judge_skipped(callback, allowed, judgement);
    }
    judgement.doubt(callback.has_grid_releases() ? unresolved_periods(callback)
                                                 : inexact_releases(callback));
  });
}

// An instance that never ended, as the totals prove, and ran beyond its deadline all the same.
void judge_never_ended(const RuleContext& context, const CallbackFacts& callback, bool is_lost,
                       std::int64_t deadline, Judgement& judgement) {
  const auto& fini = callback.fini;
  if (is_lost || !has_unended(callback)) return;
  for (const auto& open : callback.open) {
    const auto window_end = end_of_window(context.model, open.start.stream);
    // While it is still recorded, and of what came after an interruption, no more is known than that
    // its totals were told.
    const bool is_told_last = !window_end || (context.proof.is_interrupted(callback.process) &&
                                              fini->at.time < *window_end);
    const auto until = is_told_last ? fini->at.time : *window_end;
    const auto since = latest_release(open);
    judgement.check();
    if ((until - since).ns <= deadline) {
      judgement.doubt(evidence("callback_start", open.start,
                               "seq " + std::to_string(open.seq) +
                                   " never ended, and its deadline lies beyond the window"));
      continue;
    }
    judgement.fail(evidence("callback_start", open.start,
                            "seq " + std::to_string(open.seq) + " starts, released at " +
                                std::to_string(since.ns) + " at the latest, and never ends"));
    const auto later =
        nanoseconds(until - since) + " later; the deadline is " + nanoseconds(deadline);
    judgement.fail(is_told_last
                       ? evidence("callback_fini", fini->at, "its totals are told, " + later)
                       : evidence("window", moment(until), "end of the window, " + later));
  }
  const auto unended = fini->started - fini->ended;
  if (callback.open.size() < unended) {
    judgement.doubt(evidence(
        "callback_fini", fini->at,
        counted(unended, "instance") + " never ended; when they were released is not known"));
  }
}

// "8 ns"; "at least 8 ns" where no release is known exactly.
std::string largest_certain_response(const CallbackFacts& callback,
                                     const std::optional<Extreme<Duration>>& known,
                                     const Extreme<Duration>& certain) {
  const bool is_exact = known && !callback.has_grid_releases() && known->seq == certain.seq &&
                        known->value == certain.value;
  return (is_exact ? "" : "at least ") + nanoseconds(certain.value);
}

struct Late {
  const Extreme<Duration>& instance;
  std::string response;
};

// `longest`: of the callback, or of what is its own for certain. Empty: none is beyond the deadline
// for certain. Of those with a calculated release, what is certain first.
std::optional<Late> find_late(const CallbackFacts& callback, const auto& longest,
                              std::int64_t deadline) {
  const auto& [known, lower] = std::tie(longest.max_response, longest.max_response_lower);
  if (lower && lower->value.ns > deadline)
    return Late{*lower, largest_certain_response(callback, known, *lower)};
  const bool is_calculated = callback.has_grid_releases() && callback.are_releases_certain();
  if (is_calculated && known && (known->value - callback.release_error()).ns > deadline)
    return Late{*known, nanoseconds(known->value) + error_of(callback)};
  return std::nullopt;
}

// `allowed`: "the deadline of spec.yaml:3 is 8 ns".
void judge_late(const CallbackFacts& callback, std::int64_t deadline, const std::string& allowed,
                Judgement& judgement) {
  const auto response_of = [&allowed](const Late& late) {
    return "response time " + late.response + ", " + allowed;
  };
  const auto late = find_late(callback, callback, deadline);
  const auto& own = callback.own;
  const auto certain = own ? find_late(callback, *own, deadline) : late;
  if (certain) {
    fail_with(certain->instance, response_of(*certain), judgement);
  } else if (late) {
    doubt_others(callback, response_of(*late), judgement);
  }
}

// An instance that stands in the trace where other streams do not.
void judge_outside(const Extreme<Duration>& longest, std::int64_t allowed, const std::string& what,
                   Judgement& judgement) {
  if (longest.value.ns <= allowed || judgement.has_witness()) return;
  fail_with(longest, what + "; outside of what all streams cover, so not counted", judgement);
}

std::optional<Evidence> bounds_by_a_set_clock(const CallbackFacts& callback) {
  if (callback.with_doubtful_bound == 0) return std::nullopt;
  return without_event(
      callback.starts.last_at,
      "of " + counted(callback.with_doubtful_bound, "instance") +
          " a message tells when it was written by CLOCK_REALTIME, which was set meanwhile");
}

std::vector<SubjectVerdict> judge_deadline(const RuleContext& context) {
  return for_each_callback(
      context, [&context](const CallbackFacts& callback, const std::optional<Evidence>& loss,
                          Judgement& judgement) {
        if (auto unknown = unknown_entry(context, callback)) {
          judgement.doubt(*std::move(unknown));
          return;
        }
        if (!callback.response_deadline) return;
        const auto deadline = callback.response_deadline->ns;
        const auto* entry = spec_entry(context, callback);
        const bool is_specified = entry != nullptr && entry->response_deadline_ns;
        const auto origin = is_specified ? place(context, entry->line) : "callback_init";
        judgement.check(callback.instances);
        judgement.doubt(loss);
        judgement.overrule(doubtful_ends(callback, loss));
        judge_never_ended(context, callback, loss.has_value(), deadline, judgement);
        judge_late(callback, deadline, "the deadline of " + origin + " is " + nanoseconds(deadline),
                   judgement);
        if (callback.outside && callback.outside->max_response) {
          const auto& longest = *callback.outside->max_response;
          judge_outside(longest, deadline,
                        "response time at least " + nanoseconds(longest.value) +
                            ", the deadline of " + origin + " is " + nanoseconds(deadline),
                        judgement);
        }
        judgement.doubt(calculated_releases(callback));
        const auto unbounded = callback.without_upper_bound - callback.with_doubtful_bound;
        if (unbounded != 0) {
          judgement.doubt(evidence(
              "callback_start", callback.starts.first_at,
              counted(unbounded, "instance") + " without an upper bound of the response time"));
        }
        judgement.doubt(bounds_by_a_set_clock(callback));
        const auto& upper = callback.max_response_upper;
        const auto error = callback.release_error() + callback.release_spread();
        if (upper && (upper->value + error).ns > deadline) {
          judgement.doubt(start_of(*upper, " may have taken up to " + nanoseconds(upper->value) +
                                               error_of(callback) + "; the deadline is " +
                                               nanoseconds(deadline)));
        }
      });
}

std::vector<SubjectVerdict> judge_budget(const RuleContext& context) {
  const bool is_any_specified =
      specifies_any(context, [](const SpecEntry& entry) { return entry.wcet_ns.has_value(); });
  return for_each_callback(context, [&context, is_any_specified](
                                        const CallbackFacts& callback,
                                        const std::optional<Evidence>& loss, Judgement& judgement) {
    if (is_any_specified) judgement.doubt(unknown_entry(context, callback));
    const auto* entry = spec_entry(context, callback);
    if (entry == nullptr || !entry->wcet_ns) return;
    const auto wcet = *entry->wcet_ns;
    judgement.check(callback.instances);
    judgement.doubt(loss);
    judgement.overrule(doubtful_ends(callback, loss));
    const auto& longest = callback.max_execution;
    const auto& own = callback.own ? callback.own->max_execution : longest;
    const auto took = [&](const Extreme<Duration>& extreme) {
      return "execution time " + nanoseconds(extreme.value) + ", " + place(context, entry->line) +
             " declares at most " + nanoseconds(wcet);
    };
    if (own && own->value.ns > wcet) {
      fail_with(*own, took(*own), judgement);
    } else if (longest && longest->value.ns > wcet) {
      doubt_others(callback, took(*longest), judgement);
    }
    if (callback.outside && callback.outside->max_execution) {
      const auto& executed = *callback.outside->max_execution;
      judge_outside(executed, wcet, took(executed), judgement);
    }
    const auto& unmeasured = callback.max_duration_without_execution;
    if (unmeasured && unmeasured->value.ns > wcet) {
      judgement.doubt(start_of(*unmeasured, " took " + nanoseconds(unmeasured->value) +
                                                ", its CPU time is not known; declared are " +
                                                nanoseconds(wcet)));
    }
  });
}

std::vector<SubjectVerdict> judge_rate(const RuleContext& context) {
  const bool is_any_specified = specifies_any(context, [](const SpecEntry& entry) {
    return entry.min_inter_arrival_ns || entry.max_inter_arrival_ns;
  });
  return for_each_callback(context, [&context, is_any_specified](
                                        const CallbackFacts& callback,
                                        const std::optional<Evidence>& loss, Judgement& judgement) {
    if (is_any_specified) judgement.doubt(unknown_entry(context, callback));
    const auto* entry = spec_entry(context, callback);
    if (entry == nullptr) return;
    const auto& min = entry->min_inter_arrival_ns;
    const auto& max = entry->max_inter_arrival_ns;
    if (!min && !max) return;
    // Before an instance that never ended, too.
    const std::uint64_t judged = callback.min_inter_arrival ? 1 : 0;
    judgement.check(std::max(callback.inter_arrival.count(), judged));
    judgement.overrule(loss);
    if (callback.instances >= 2) {
      judgement.doubt(inexact_releases(callback));
      judgement.doubt(calculated_releases(callback));
    }
    if (callback.is_reordered) {  // then others may lie between two that are far apart
      judgement.doubt(evidence("callback_start", callback.starts.last_at,
                               "instances started in another order than they were released in"));
    }
    const auto error = 2 * callback.release_error().ns;  // of two releases
    const auto outside = [&](const Extreme<Duration>& extreme, const char* bound,
                             std::int64_t value, std::int64_t excess, bool is_certain) {
      if (excess + error <= 0) return;
      auto witness = start_of(extreme, " was released " + nanoseconds(extreme.value) +
                                           " after the one before it; " +
                                           place(context, entry->line) + " declares " + bound +
                                           ' ' + nanoseconds(value) + error_of(callback));
      if (is_certain && callback.are_releases_certain() && excess > error) {
        judgement.fail(std::move(witness));
      } else {
        judgement.doubt(std::move(witness));
      }
    };
    if (min && callback.min_inter_arrival) {
      const auto& shortest = *callback.min_inter_arrival;
      outside(shortest, "at least", *min, *min - shortest.value.ns, true);
    }
    if (max && callback.max_inter_arrival) {
      const auto& longest = *callback.max_inter_arrival;
      outside(longest, "at most", *max, longest.value.ns - *max, !callback.is_reordered);
    }
  });
}

}  // namespace

const Rule kArrivalExceedsTurnaround{
    .id = kArrivalExceedsTurnaroundRule,
    .name = "arrival-exceeds-turnaround",
    .meaning =
        "Each instance ends before the next one is released: the shortest inter-arrival time "
        "exceeds the longest response time. Fewer than two instances are not judged. One that "
        "never ended was released as well: that counts, and so does the release after it.",
    .why_it_matters =
        "This is the assumption under which one thread per callback needs no queue: when it does "
        "not hold, instances wait for the one before them and delays add up.",
    .inconclusive_when = "releases are not known exactly, or instances were lost.",
    .remedy =
        "shorten the callback, raise its priority or give it a CPU, or slow its source down; cie "
        "report shows where the time went.",
    .violation = "overran the next release",
    .main_evidence = 1,
    .judge = judge_arrival,
    .needs = {.instances = true, .totals = true}};

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
    .needs = {.instances = true, .totals = true}};

const Rule kDeadline{
    .id = kDeadlineRule,
    .name = "deadline",
    .meaning =
        "Response times stay within the deadline: response_deadline of the spec, else the one the "
        "callback declared. Where a release is not known, FAIL needs the lower bound of the "
        "response time above the deadline and PASS the upper bound within it. An instance that "
        "never ended fails when the window ends after its deadline; one outside of what all "
        "streams cover is not counted, and fails if it was late.",
    .why_it_matters = "A result after its deadline is a wrong result.",
    .inconclusive_when =
        "the bounds of a response time lie on both sides of the deadline, CLOCK_REALTIME was set "
        "between the writing of a message and its taking (a clock_sync shows it), or instances "
        "were lost.",
    .remedy =
        "the evidence names the instance: cie report tells what it waited for, cie analyze "
        "schedulability what it may have to wait for at worst.",
    .violation = "missed deadlines",
    .gravity = 1,
    .main_evidence = 1,
    .judge = judge_deadline,
    .needs = {.instances = true, .totals = true}};

const Rule kBudget{
    .id = kBudgetRule,
    .name = "budget",
    .meaning =
        "Execution times (on-CPU time, not duration) stay within the declared wcet. Where the "
        "kernel's record of an instance has a hole, lacks a CPU that it may have run on, or is "
        "absent, the instance passes if its whole duration does. One outside of what all streams "
        "cover is not counted, and fails if it took too long.",
    .why_it_matters =
        "Budgets and response-time analyses rest on the wcet: one callback that takes more "
        "invalidates the bounds of all below it.",
    .inconclusive_when =
        "an instance took longer than the wcet and its CPU time is not known, or instances were "
        "lost.",
    .remedy =
        "record with --kernel; make the callback faster, or declare what it really takes and "
        "analyze again.",
    .violation = "exceeded the budget",
    .main_evidence = 1,
    .judge = judge_budget,
    .needs = {.instances = true, .spec = true, .totals = true}};

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
    .needs = {.instances = true, .spec = true, .totals = true}};

}  // namespace cie::analysis
