// Two recordings side by side: what became slower, by more than a tolerance and more than chance.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/statistics.hpp>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

// Every single statement about a quantile or a rate is wrong with at most this probability, if
// instances are independent: 0.1 %, small because there is a statement for every callback.
inline constexpr double kComparisonError = 0.001;

// Some of the ordered values of a sample: value by rank, 1 for the smallest.
struct OrderStatistics {
  std::uint64_t count = 0;
  std::map<std::uint64_t, std::int64_t> by_rank;

  // The ranks that comparisons look at, known within the histogram's bound (0.8 %).
  static OrderStatistics of(const Statistics& statistics);
  // What a report keeps: extremes and four quantiles. Leaves most comparisons undecided.
  static OrderStatistics of(const Summary& summary);
};

// A quantile's confidence interval by order statistics, which assumes no distribution: the ranks
// between which the quantile lies are binomial (H. A. David, H. N. Nagaraja: Order Statistics, 3rd
// ed., section 7.1). A bound is empty when the sample is too small to have it.
struct QuantileInterval {
  std::optional<std::int64_t> lower;
  std::int64_t estimate = 0;  // nearest rank
  std::optional<std::int64_t> upper;
};
// `per_mille`: 500 is the median. Empty for an empty sample.
std::optional<QuantileInterval> quantile_interval(const OrderStatistics& sample,
                                                  unsigned per_mille);

enum class Change : std::uint8_t {
  within,     // no more than the tolerance, for certain
  better,     // for certain
  undecided,  // the samples are too small to tell
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
  friend bool operator==(const Lateness&, const Lateness&) = default;
  // Empty without a deadline.
  static std::optional<Lateness> of(const CallbackReport& callback);
};

// What a comparison knows of one callback of one side.
struct CallbackSample {
  std::string logical_id;
  std::uint64_t instances = 0;
  std::optional<std::uint64_t> missed_releases;
  std::optional<Isolation> isolation;  // empty: unknown
  OrderStatistics response_time;
  OrderStatistics start_latency;
  OrderStatistics duration;
  std::optional<Lateness> lateness{};
};

// Collects samples while a recording is analysed, with the rules of the report: complete instances,
// response time and start latency of exact releases.
class SampleCollector final : public Observer {
 public:
  void on_instance(const Instance& instance) override;
  // One per callback of the report, in its order. Callbacks of one logical id in several processes
  // are one.
  std::vector<CallbackSample> samples(const Report& report) const;

 private:
  struct Measured {
    std::string logical_id;
    Statistics response_time;
    Statistics start_latency;
    Statistics duration;
  };
  std::vector<Measured> measured_;  // by Instance::callback
};

struct QuantityChange {
  std::string quantity;    // "response_time", "start_latency", "duration"
  unsigned per_mille = 0;  // of the quantile
  std::optional<QuantileInterval> before;
  std::optional<QuantileInterval> after;
  Change change = Change::undecided;
};

struct CallbackChange {
  std::string logical_id;
  bool is_before = false;
  bool is_after = false;
  std::uint64_t instances_before = 0;
  std::uint64_t instances_after = 0;
  std::vector<QuantityChange> quantities;  // empty unless it is on both sides
  std::optional<std::uint64_t> missed_before;
  std::optional<std::uint64_t> missed_after;
  Change missed = Change::undecided;
  bool lost_isolation = false;
  std::optional<Lateness> lateness_before{};
  std::optional<Lateness> lateness_after{};

  // Gone, slower, missing more releases, or no longer isolated.
  bool is_regression() const;
};

// Callbacks of either side, matched and sorted by logical id.
std::vector<CallbackChange> compare(const std::vector<CallbackSample>& before,
                                    const std::vector<CallbackSample>& after, double tolerance);

}  // namespace cie::analysis
