#include <cie/analysis/comparison.hpp>
#include <cie/analysis/report_rows.hpp>

#include "binomial.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

namespace cie::analysis {
namespace {

double with(std::int64_t value, double tolerance) {
  const auto exact = static_cast<double>(value);
  return exact + std::abs(exact) * tolerance;
}

// How long the record after is, in terms of the one before; 1 where that is not known.
struct LengthRatio {
  double after_per_before = 1;

  static LengthRatio of(const ComparedRecord& before, const ComparedRecord& after) {
    if (!before.length || !after.length || before.length->ns <= 0 || after.length->ns <= 0)
      return {};
    return {static_cast<double>(after.length->ns) / static_cast<double>(before.length->ns)};
  }
};

// What callbacks are judged by besides their samples.
struct Records {
  bool is_after_complete = false;
  LengthRatio ratio;
};

std::vector<QuantityChange> quantities(const CallbackSample& before, const CallbackSample& after,
                                       double tolerance) {
  std::vector<QuantityChange> changes;
  const auto add = [&](const char* name, OrderStatistics CallbackSample::*quantity) {
    // Lower bounds on both sides decide nothing.
    if ((before.*quantity).at_most.empty() && (after.*quantity).at_most.empty()) return;
    for (const unsigned per_mille : kComparedQuantiles) {
      QuantityChange change{.quantity = name,
                            .per_mille = per_mille,
                            .before = quantile_interval(before.*quantity, per_mille),
                            .after = quantile_interval(after.*quantity, per_mille)};
      if (change.before && change.after) {
        change.change = compare(*change.before, *change.after, tolerance);
      }
      changes.push_back(std::move(change));
    }
  };
  add("response_time", &CallbackSample::response_time);
  add("start_latency", &CallbackSample::start_latency);
  add("duration", &CallbackSample::duration);
  return changes;
}

// Whether the callback runs less than `share` times as often as before, beyond chance: the test of
// two rates again.
bool runs_less(const CallbackSample& before, const CallbackSample& after, const LengthRatio& ratio,
               double share) {
  const auto runs_before = before.instances + before.incomplete;
  const auto runs_after = after.instances + after.incomplete;
  if (runs_before == 0) return false;
  const double weight = ratio.after_per_before * share;
  return binomial_cdf(runs_before + runs_after, weight / (1 + weight),
                      static_cast<std::int64_t>(runs_after)) < kComparisonError;
}

bool is_same(const CallbackSample& before, const CallbackSample& after, const LengthRatio& ratio,
             const std::vector<QuantityChange>& quantities) {
  return ratio.after_per_before == 1 && before.instances == after.instances &&
         before.incomplete == after.incomplete && !quantities.empty() &&
         std::ranges::all_of(quantities,
                             [](const QuantityChange& each) { return each.before == each.after; });
}

// Processes that a report tells of may have lived at one time, or one after the other.
bool may_be_fewer(const CallbackSample& before, const CallbackSample& after) {
  if (before.are_lives_told && after.are_lives_told) return false;
  return after.processes_at_once.value_or(1) < before.processes_at_once.value_or(before.processes);
}

Absence absence_of(const CallbackSample& before, const CallbackSample& after,
                   const LengthRatio& ratio, const std::vector<QuantityChange>& quantities) {
  if (!after.has_run() && runs_less(before, after, ratio, 1)) return Absence::never_runs;
  // Those of a program that was started again are one at a time.
  const bool is_known = before.processes_at_once && after.processes_at_once;
  const bool is_fewer =
      is_known ? *after.processes_at_once < *before.processes_at_once
               : after.processes < before.processes ||
                     (may_be_fewer(before, after) && !is_same(before, after, ratio, quantities));
  return is_fewer ? Absence::gone_from_process : Absence::none;
}

CountChange change_of(const std::optional<std::uint64_t>& before, std::uint64_t trials_before,
                      const std::optional<std::uint64_t>& after, std::uint64_t trials_after,
                      double tolerance) {
  CountChange found{.before = before, .after = after};
  if (before && after)
    found.change = compare(Rate{*before, trials_before}, Rate{*after, trials_after}, tolerance);
  return found;
}

// Of what comes on top of the runs: the share of all.
CountChange change_of(std::optional<std::uint64_t> CallbackSample::*count,
                      const CallbackSample& before, const CallbackSample& after, double tolerance) {
  return change_of(before.*count, before.instances + (before.*count).value_or(0), after.*count,
                   after.instances + (after.*count).value_or(0), tolerance);
}

// Releases that one delay missed are no independent events: where that is known, it counts once.
CountChange change_of_missed(const CallbackSample& before, const CallbackSample& after,
                             double tolerance) {
  auto found = change_of(&CallbackSample::missed_releases, before, after, tolerance);
  if (before.missing_instances && after.missing_instances) {
    found.change = change_of(before.missing_instances, before.instances, after.missing_instances,
                             after.instances, tolerance)
                       .change;
  }
  return found;
}

bool are_of_one_deadline(const std::optional<Lateness>& before,
                         const std::optional<Lateness>& after) {
  return before && after && before->deadline == after->deadline;
}

// Of one deadline. Where more may have been late than is known, that may be as many as one likes.
CountChange change_of_late(const std::optional<Lateness>& before,
                           const std::optional<Lateness>& after, double tolerance) {
  if (!are_of_one_deadline(before, after)) return {};
  auto found = change_of(before->late, before->instances, after->late, after->instances, tolerance);
  const bool is_open = found.change == Change::worse ? before->is_late_bound : after->is_late_bound;
  if (is_open) found.change = Change::undecided;
  return found;
}

bool has_other_releases(const CallbackSample& before, const CallbackSample& after) {
  const bool is_any_skipped =
      before.missed_releases.value_or(0) > 0 || after.missed_releases.value_or(0) > 0;
  return is_any_skipped && before.timer_releases.are_known() && after.timer_releases.are_known() &&
         before.timer_releases != after.timer_releases;
}

// Whether a complete record after proves it: not where it tells of runs before it began.
bool can_be_proved(Absence absence, const CallbackSample& before, const CallbackSample& after) {
  switch (absence) {
    case Absence::gone_from_process:
      return before.processes_at_once && after.processes_at_once;
    case Absence::never_runs:
      return after.runs_not_seen == 0;
    case Absence::gone:
    case Absence::gone_unused:
      return true;
    case Absence::none:
      break;
  }
  return false;
}

CallbackChange change_of(const CallbackSample& before, const CallbackSample& after,
                         const Records& records, double tolerance) {
  constexpr double kHalf = 0.5;
  auto compared = quantities(before, after, tolerance);
  const auto absence = absence_of(before, after, records.ratio, compared);
  return {.logical_id = before.logical_id,
          .is_before = true,
          .is_after = true,
          .processes_before = before.processes,
          .processes_after = after.processes,
          .instances_before = before.instances,
          .instances_after = after.instances,
          .incomplete_before = before.incomplete,
          .incomplete_after = after.incomplete,
          .absence = absence,
          .is_absence_proved = records.is_after_complete && can_be_proved(absence, before, after),
          .never_ends = before.never_ends == false && after.never_ends == true,
          .runs_less = after.has_run() && runs_less(before, after, records.ratio, kHalf),
          .quantities = std::move(compared),
          .counts = {change_of_late(before.lateness, after.lateness, tolerance),
                     change_of_missed(before, after, tolerance),
                     change_of(before.exceptions, before.instances, after.exceptions,
                               after.instances, tolerance),
                     change_of(&CallbackSample::lost_samples, before, after, tolerance),
                     change_of(&CallbackSample::overwritten_samples, before, after, tolerance)},
          .lost_isolation = before.is_isolation_claimed &&
                            before.isolation == Isolation::isolated &&
                            after.isolation == Isolation::not_isolated,
          .lateness_before = before.lateness,
          .lateness_after = after.lateness,
          .has_other_releases = has_other_releases(before, after)};
}

CallbackChange one_sided(const CallbackSample& sample, bool is_before, const Records& records) {
  CallbackChange change;
  change.logical_id = sample.logical_id;
  (is_before ? change.is_before : change.is_after) = true;
  (is_before ? change.processes_before : change.processes_after) = sample.processes;
  (is_before ? change.instances_before : change.instances_after) = sample.instances;
  (is_before ? change.incomplete_before : change.incomplete_after) = sample.incomplete;
  auto& exceptions = change.of(Count::exceptions);
  (is_before ? exceptions.before : exceptions.after) = sample.exceptions;
  if (is_before) {
    const bool is_unused = !sample.has_run() && sample.runs_not_seen == 0;
    change.absence = is_unused ? Absence::gone_unused : Absence::gone;
    change.is_absence_proved = records.is_after_complete;
  }
  return change;
}

bool is_absent(const CallbackChange& change) {
  return change.absence != Absence::none && change.absence != Absence::gone_unused;
}

// What the trace's kernel events, chains and read-backs lack leaves every run in the record.
bool may_cost_runs(const TraceDefect& defect) {
  switch (defect.kind) {
    case DefectKind::unseen_kernel:
    case DefectKind::sched_switch_gaps:
    case DefectKind::cpus_not_recorded:
    case DefectKind::publish_gaps:
    case DefectKind::unregistered_publishers:
    case DefectKind::read_back_gaps:
    case DefectKind::incomplete_chains:
    case DefectKind::clocks_drifted:
    case DefectKind::impossible_releases:
    case DefectKind::identity_failures:
      return false;
    default:
      return defect.severity != Severity::info;
  }
}

// Whether more instances may have been late than certainly were. Calculated releases may be too late.
bool may_be_late_more_often(const CallbackReport& callback) {
  const auto& known = callback.response_time;
  const auto& unknown = callback.response_time_lower;
  const auto deadline = callback.response_deadline->ns;
  const auto most = at_most_where_unknown(callback);
  if (unknown && (!most || *most > deadline)) return true;
  return callback.release_error && known && known->max + callback.release_error->ns > deadline;
}

}  // namespace

std::string_view label(Change change) noexcept {
  constexpr std::array<std::string_view, 4> kLabels{"within", "better", "undecided", "worse"};
  return kLabels.at(static_cast<std::size_t>(change));
}

TimerReleases TimerReleases::of(const CallbackReport& callback) {
  if (callback.kind != CallbackKind::timer || !callback.response_time) return {};
  const bool is_grid =
      callback.release_error || callback.release_source == ReleaseSource::timer_grid;
  const bool is_recorded = !is_grid && callback.release_source == ReleaseSource::exact;
  return {.are_recorded = is_recorded, .are_of_grid = is_grid};
}

std::optional<Lateness> Lateness::of(const CallbackReport& callback) {
  if (!callback.response_deadline || !callback.late) return std::nullopt;
  const auto longest = longest_response(callback);
  return Lateness{.deadline = *callback.response_deadline,
                  .late = *callback.late,
                  .instances = callback.instances,
                  .max = longest ? std::optional(longest->ns) : std::nullopt,
                  .is_max_bound = longest && longest->is_bound,
                  .is_late_bound = may_be_late_more_often(callback)};
}

Change compare(const QuantileInterval& before, const QuantileInterval& after, double tolerance) {
  if (after.lower && before.upper &&
      static_cast<double>(*after.lower) > with(*before.upper, tolerance)) {
    return Change::worse;
  }
  if (after.upper && before.lower &&
      with(*after.upper, tolerance) < static_cast<double>(*before.lower)) {
    return Change::better;
  }
  if (after.upper && before.lower &&
      static_cast<double>(*after.upper) <= with(*before.lower, tolerance)) {
    return Change::within;
  }
  return Change::undecided;
}

Change compare(const Rate& before, const Rate& after, double tolerance) {
  const std::uint64_t events = before.events + after.events;
  if (events == 0) return Change::within;
  if (before.trials == 0 || after.trials == 0) return Change::undecided;
  // The share that falls on the time after, if the rate grew by just the tolerance.
  const auto weight_before = static_cast<double>(before.trials);
  const double weight_after = static_cast<double>(after.trials) * (1 + tolerance);
  const double share = weight_after / (weight_before + weight_after);
  const auto seen = static_cast<std::int64_t>(after.events);
  if (1 - binomial_cdf(events, share, seen - 1) < kComparisonError) return Change::worse;
  if (binomial_cdf(events, share, seen) < kComparisonError) {
    const double even =
        static_cast<double>(after.trials) / (weight_before + static_cast<double>(after.trials));
    return binomial_cdf(events, even, seen) < kComparisonError ? Change::better : Change::within;
  }
  return Change::undecided;
}

std::string_view label(Count count) noexcept {
  constexpr std::array<std::string_view, kCounts.size()> kLabels{
      "late", "missed_releases", "exceptions", "lost_samples", "overwritten_samples"};
  return kLabels.at(static_cast<std::size_t>(count));
}

std::string_view label(Absence absence) noexcept {
  constexpr std::array<std::string_view, 5> kLabels{"none", "gone", "gone_from_process",
                                                    "never_runs", "gone_unused"};
  return kLabels.at(static_cast<std::size_t>(absence));
}

std::string_view label(Outcome outcome) noexcept {
  constexpr std::array<std::string_view, 4> kLabels{"no_regression", "regression", "undecided",
                                                    "nothing_compared"};
  return kLabels.at(static_cast<std::size_t>(outcome));
}

ComparedRecord ComparedRecord::of(const TraceSummary& trace,
                                  const std::vector<TraceDefect>& defects, bool has_callbacks) {
  ComparedRecord record;
  record.hosts = trace.hosts;
  record.is_complete = trace.complete && has_callbacks;
  // A record is complete although events were discarded that no run needs.
  if (!record.is_complete) {
    for (const auto& defect : defects) {
      if (!may_cost_runs(defect)) continue;
      const bool is_of_recorder = defect.kind == DefectKind::recorder_problem;
      const auto known = std::ranges::find(record.losses, defect.kind, &RecordLoss::kind);
      if (known == record.losses.end() || is_of_recorder) {
        record.losses.push_back(
            {defect.kind, defect.count, is_of_recorder ? defect.advice : std::string()});
      } else {
        known->count += defect.count;
      }
    }
  }
  if (trace.begin && trace.end && trace.hosts.size() <= 1)
    record.length = *trace.end - *trace.begin;
  return record;
}

bool CallbackChange::has(Change change) const {
  const auto is_so = [change](const auto& each) { return each.change == change; };
  return std::ranges::any_of(quantities, is_so) || std::ranges::any_of(counts, is_so);
}

bool CallbackChange::is_regression() const {
  return (is_absence_proved && is_absent(*this)) || never_ends || lost_isolation ||
         has(Change::worse);
}

bool CallbackChange::has_one_deadline() const {
  return are_of_one_deadline(lateness_before, lateness_after);
}

Outcome Comparison::outcome() const {
  const auto any = [this](const auto& is_so) { return std::ranges::any_of(callbacks, is_so); };
  if (any([](const CallbackChange& change) { return change.is_regression(); }))
    return Outcome::regression;
  if (!has_compared() && !any(is_absent)) return Outcome::nothing_compared;
  return may_lack_runs() || !has_decided() ? Outcome::undecided : Outcome::no_regression;
}

bool Comparison::may_lack_runs() const {
  return !before.losses.empty() || !after.losses.empty() ||
         std::ranges::any_of(callbacks, is_absent);
}

// The same recording, or as good as the same: equal numbers need no statistics.
bool Comparison::is_equal() const {
  const auto has_times = [](const CallbackChange& change) { return !change.quantities.empty(); };
  return std::ranges::any_of(callbacks, has_times) &&
         std::ranges::all_of(callbacks, [](const CallbackChange& change) {
           return change.instances_before == change.instances_after &&
                  change.incomplete_before == change.incomplete_after &&
                  std::ranges::all_of(change.quantities, [](const QuantityChange& each) {
                    return each.before == each.after;
                  });
         });
}

bool Comparison::has_decided() const {
  return is_equal() || std::ranges::any_of(callbacks, [](const CallbackChange& change) {
           const auto is_decided = [](const QuantityChange& each) {
             return each.change != Change::undecided;
           };
           return std::ranges::any_of(change.quantities, is_decided) || change.has(Change::better);
         });
}

bool Comparison::has_compared() const {
  return std::ranges::any_of(callbacks, [](const CallbackChange& change) {
    return change.instances_before > 0 && change.instances_after > 0;
  });
}

Comparison compare(const ComparedSide& before, const ComparedSide& after, double tolerance) {
  std::map<std::string_view, std::pair<const CallbackSample*, const CallbackSample*>> by_id;
  for (const auto& sample : before.callbacks)
    by_id[sample.logical_id].first = &sample;
  for (const auto& sample : after.callbacks)
    by_id[sample.logical_id].second = &sample;
  const Records records{.is_after_complete = after.record.is_complete,
                        .ratio = LengthRatio::of(before.record, after.record)};
  Comparison comparison{.before = before.record, .after = after.record, .callbacks = {}};
  for (const auto& [id, sides] : by_id) {
    const auto* was = sides.first;
    const auto* is = sides.second;
    comparison.callbacks.push_back(
        was != nullptr && is != nullptr
            ? change_of(*was, *is, records, tolerance)
            : one_sided(was != nullptr ? *was : *is, was != nullptr, records));
  }
  return comparison;
}

}  // namespace cie::analysis
