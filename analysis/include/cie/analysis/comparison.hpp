// Two recordings side by side: what became slower, by more than a tolerance and more than chance.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/rare.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/statistics.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace cie::analysis {

class ReportRows;

// Every single statement about a quantile or a rate is wrong with at most this probability, if
// instances are independent: 0.1 %, small because there is a statement for every callback.
inline constexpr double kComparisonError = 0.001;

// The quantiles that are compared, in per mille.
inline constexpr std::array<unsigned, 2> kComparedQuantiles{500, 990};

// What is printed of a quantile.
struct QuantileEstimate {
  std::int64_t ns = 0;
  bool is_bound = false;  // the quantile is at least that: releases are not known
  friend bool operator==(const QuantileEstimate&, const QuantileEstimate&) = default;
};

// What is certain of the ordered values of a sample, by rank, 1 for the smallest: histograms know
// between which values the one of a rank lies, and no verdict rests on what stands for it.
struct OrderStatistics {
  std::uint64_t count = 0;
  std::map<std::uint64_t, std::int64_t> at_least;  // ascending, as the ranks
  std::map<std::uint64_t, std::int64_t> at_most;
  std::map<unsigned, QuantileEstimate> estimates;  // by per mille

  // The ranks that comparisons look at.
  static OrderStatistics of(const Statistics& statistics);
  // Of values that are bounded only: each by one of `at_least`, and those that have an upper bound
  // by one of `at_most`.
  static OrderStatistics of(const Statistics& at_least, const Statistics& at_most);
  // What a report keeps: extremes and four quantiles. Leaves most comparisons undecided.
  static OrderStatistics of(const Rare<Summary>& summary);
  // The same of a report's response times and start latencies: of all complete instances, whether
  // their release is known or bounded.
  static OrderStatistics of_response_time(const CallbackReport& callback);
  static OrderStatistics of_start_latency(const CallbackReport& callback);
};
// What is certain of the values of both together.
OrderStatistics merged(const OrderStatistics& a, const OrderStatistics& b);

// A quantile's confidence interval by order statistics, which assumes no distribution: the ranks
// between which the quantile lies are binomial (H. A. David, H. N. Nagaraja: Order Statistics, 3rd
// ed., section 7.1). A bound is empty when the sample is too small to have it.
struct QuantileInterval {
  std::optional<std::int64_t> lower;
  QuantileEstimate estimate;  // nearest rank
  std::optional<std::int64_t> upper;
  friend bool operator==(const QuantileInterval&, const QuantileInterval&) = default;
};
// `per_mille`: 500 is the median. Empty for an empty sample.
std::optional<QuantileInterval> quantile_interval(const OrderStatistics& sample,
                                                  unsigned per_mille);

enum class Change : std::uint8_t {
  within,     // no more than the tolerance, for certain
  better,     // for certain
  undecided,  // the samples are too small to tell, or one of them is not there
  worse       // by more than the tolerance, for certain
};
std::string_view label(Change change) noexcept;  // "within", "better", "undecided", "worse"

// `tolerance`: 0.05 for 5 %.
Change compare(const QuantileInterval& before, const QuantileInterval& after, double tolerance);

// Events per trial before and after. A rate is worse if it grew by more than the tolerance, beyond
// chance: given their sum, the events after are binomial (conditional test of two Poisson rates,
// J. Przyborowski, H. Wilenski, Biometrika 31, 1940).
struct Rate {
  std::uint64_t events = 0;
  std::uint64_t trials = 0;
};
Change compare(const Rate& before, const Rate& after, double tolerance);

// How a callback kept its deadline; of several processes' together.
struct Lateness {
  Duration deadline;
  std::uint64_t late = 0;
  std::uint64_t instances = 0;
  std::optional<std::int64_t> max;  // of its response times
  bool is_max_bound = false;        // of an instance whose release is not known: at least that
  bool is_late_bound = false;  // of some it is not known whether they were late: at least so many
  friend bool operator==(const Lateness&, const Lateness&) = default;
  // Empty without a deadline.
  static std::optional<Lateness> of(const CallbackReport& callback);
};

// What the release of an instance of a timer that skipped periods is: what was recorded is the
// latest expiry that was due, what follows from ROS 2's grid the oldest one that waited.
struct TimerReleases {
  bool are_recorded = false;
  bool are_of_grid = false;
  // Neither for what is no timer, or has no known release.
  static TimerReleases of(const CallbackReport& callback);
  bool are_known() const noexcept { return are_recorded || are_of_grid; }
  friend bool operator==(const TimerReleases&, const TimerReleases&) = default;
};

// What a comparison knows of one callback of one side, in all of its processes.
struct CallbackSample {
  std::string logical_id;
  std::uint64_t processes = 1;  // that had it
  // Most of those that had it at one time; empty: not known, a report does not say.
  std::optional<std::uint64_t> processes_at_once{};
  bool are_lives_told = true;  // when its processes lived; a report does not say
  std::uint64_t instances = 0;
  std::uint64_t incomplete = 0;     // open or cut by an edge
  std::uint64_t runs_not_seen = 0;  // as in CallbackReport
  // Whether totals prove of one of its runs that it did not end. Empty: one may not have ended.
  std::optional<bool> never_ends{};
  std::optional<std::uint64_t> exceptions{};  // empty: not told
  std::optional<std::uint64_t> missed_releases;
  // Before how many instances they were missed: one delay misses several. Empty: a report does not say.
  std::optional<std::uint64_t> missing_instances{};
  std::optional<Isolation> isolation;  // empty: unknown
  // Its executor is the isolated one, threads for callbacks ran it, or no callback of its process shared
  // a thread, where nobody names the executor (ROS 2): not by chance alone.
  bool is_isolation_claimed = false;
  OrderStatistics response_time;
  OrderStatistics start_latency;
  OrderStatistics duration;
  std::optional<Lateness> lateness{};
  // While it was recorded.
  std::optional<std::uint64_t> lost_samples{};
  std::optional<std::uint64_t> overwritten_samples{};
  TimerReleases timer_releases{};

  // What a report counts of it; its times are another matter.
  static CallbackSample of(const CallbackReport& callback);
  bool has_run() const noexcept { return instances + incomplete > 0; }
};

// One for each logical id, in the order in which they came.
class SamplesById {
 public:
  // Adds it to that of the same logical id, if there is one.
  void add(CallbackSample sample);
  std::vector<CallbackSample> take() && { return std::move(samples_); }

 private:
  std::vector<CallbackSample> samples_;
  std::unordered_map<std::string, std::size_t> places_;  // of ids
};

// Runs may be missing from the record for this reason.
struct RecordLoss {
  DefectKind kind{};
  std::uint64_t count = 0;
  std::string advice{};  // of a recorder's problem, of which each is one: what it said
  friend bool operator==(const RecordLoss&, const RecordLoss&) = default;
};

// What a side's record says of itself.
struct ComparedRecord {
  bool is_complete = false;          // it proves that nothing is missing
  std::vector<RecordLoss> losses;    // none is no such proof
  std::optional<Duration> length;    // empty: not known, or of several hosts' clocks
  std::vector<std::string> hosts{};  // runs of one logical id on any of them count together

  // One without callbacks is complete only because nothing in it could be missing: no proof.
  static ComparedRecord of(const TraceSummary& trace, const std::vector<TraceDefect>& defects,
                           bool has_callbacks);
};

// A recording, or a report of one.
struct ComparedSide {
  ComparedRecord record;
  std::vector<CallbackSample> callbacks;
};

// Collects samples while a recording is analysed, of complete instances. An instance whose release
// is not known counts with what bounds its response time and start latency: without it the others
// would stand for all.
class SampleCollector final : public Observer {
 public:
  void on_instance(const Instance& instance) override;
  // One per callback of the report, in its order. Callbacks of one logical id in several processes
  // are one.
  std::vector<CallbackSample> samples(const Report& report) const;

 private:
  struct Lives;
  struct Bounded {
    Statistics at_least;
    Statistics at_most;
  };
  struct Measured {
    std::string logical_id;
    Timestamp first_start{};
    Timestamp last_end{};
    Bounded response_time;
    Bounded start_latency;
    Statistics duration;
    std::uint64_t missing_instances = 0;

    void merge_quantities(const Measured& other);
    Measured without_releases() const;
  };
  std::map<std::string_view, Lives> lives_by_id(const Report& report, const ReportRows& rows) const;

  std::vector<Measured> measured_;  // by Instance::callback
};

struct QuantityChange {
  std::string quantity;    // "response_time", "start_latency", "duration"
  unsigned per_mille = 0;  // of the quantile
  std::optional<QuantileInterval> before;
  std::optional<QuantileInterval> after;
  Change change = Change::undecided;
};

// What is not there after that was before.
enum class Absence : std::uint8_t {
  none,
  gone,               // it is registered nowhere
  gone_from_process,  // fewer processes have it at a time
  never_runs,         // more often not than chance explains, by how often it ran before
  gone_unused  // like gone, and no run of it was recorded before: nothing is known to be worse
};
std::string_view label(Absence absence) noexcept;  // "none", "gone", "gone_from_process", …

// What is counted of a callback, and compared by rate.
enum class Count : std::uint8_t {
  late,
  missed_releases,
  exceptions,
  lost_samples,
  overwritten_samples
};
inline constexpr std::array kCounts{Count::late, Count::missed_releases, Count::exceptions,
                                    Count::lost_samples, Count::overwritten_samples};
std::string_view label(Count count) noexcept;  // "late", "missed_releases", …

struct CountChange {
  std::optional<std::uint64_t> before;  // empty: not known; of late instances: not of one deadline
  std::optional<std::uint64_t> after;
  Change change = Change::undecided;
};

struct CallbackChange {
  std::string logical_id;
  bool is_before = false;
  bool is_after = false;
  std::uint64_t processes_before = 0;
  std::uint64_t processes_after = 0;
  std::uint64_t instances_before = 0;
  std::uint64_t instances_after = 0;
  std::uint64_t incomplete_before = 0;
  std::uint64_t incomplete_after = 0;
  Absence absence = Absence::none;
  bool is_absence_proved = false;          // by a complete record after, in which no run is unseen
  bool never_ends = false;                 // proved of a run after, and that there was none before
  bool runs_less = false;                  // less than half as often as before, beyond chance
  std::vector<QuantityChange> quantities;  // empty unless it is on both sides
  std::array<CountChange, kCounts.size()> counts{};  // in the order of kCounts
  bool lost_isolation = false;
  std::optional<Lateness> lateness_before{};
  std::optional<Lateness> lateness_after{};
  // A timer skipped periods: its releases are then different expiries before and after.
  bool has_other_releases = false;

  CountChange& of(Count count) { return counts.at(static_cast<std::size_t>(count)); }
  const CountChange& of(Count count) const { return counts.at(static_cast<std::size_t>(count)); }
  // Some quantile or count is certain to have changed so.
  bool has(Change change) const;
  // Of what is certain: gone although it ran, never running or never ending, no longer isolated, or
  // some quantile or count is worse.
  bool is_regression() const;
  bool has_one_deadline() const;  // before and after
};

enum class Outcome : std::uint8_t {
  no_regression,
  regression,       // for certain
  undecided,        // none is, but a record lacks runs, does not prove that a callback is gone, or
                    // no time is decided
  nothing_compared  // no callback ran on both sides
};
std::string_view label(Outcome outcome) noexcept;  // "no_regression", "regression", …

struct Comparison {
  ComparedRecord before;
  ComparedRecord after;
  std::vector<CallbackChange> callbacks;  // of either side, matched and sorted by logical id

  Outcome outcome() const;
  bool has_compared() const;  // a callback ran before and after
  // A record lacks runs, or does not prove that a callback is gone.
  bool may_lack_runs() const;
  // Runs and all times are equal, and there are times.
  bool is_equal() const;
  // It is certain how some quantile changed, or that it did not; or a count became better.
  bool has_decided() const;
};
Comparison compare(const ComparedSide& before, const ComparedSide& after, double tolerance);

}  // namespace cie::analysis
