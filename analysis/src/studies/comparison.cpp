#include <cie/analysis/comparison.hpp>
#include <cie/analysis/deadline.hpp>

#include "binomial.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::array<unsigned, 2> kQuantiles{500, 990};
constexpr double kPerMille = 1000;

std::uint64_t nearest_rank(std::uint64_t count, unsigned per_mille) {
  const auto product = static_cast<Int128>(count) * per_mille;
  return std::max<std::uint64_t>(1, static_cast<std::uint64_t>((product + 999) / 1000));
}

// The quantile is at least the value of the first rank and at most that of the second, each but for
// half the error. 0, or more than there are: no such rank.
std::pair<std::uint64_t, std::uint64_t> bounding_ranks(std::uint64_t count, unsigned per_mille) {
  const double p = per_mille / kPerMille;
  const auto lower = binomial_quantile(count, p, kComparisonError / 2);
  const auto upper = binomial_quantile(count, p, 1 - kComparisonError / 2) + 1;
  return {static_cast<std::uint64_t>(lower), static_cast<std::uint64_t>(upper)};
}

std::optional<std::int64_t> largest_at_most(const OrderStatistics& sample, std::uint64_t rank) {
  const auto after = sample.by_rank.upper_bound(rank);
  if (after == sample.by_rank.begin()) return std::nullopt;
  return std::prev(after)->second;
}

std::optional<std::int64_t> smallest_at_least(const OrderStatistics& sample, std::uint64_t rank) {
  const auto found = sample.by_rank.lower_bound(rank);
  if (found == sample.by_rank.end()) return std::nullopt;
  return found->second;
}

double with(std::int64_t value, double tolerance) {
  return static_cast<double>(value) * (1 + tolerance);
}

std::vector<QuantityChange> quantities(const CallbackSample& before, const CallbackSample& after,
                                       double tolerance) {
  std::vector<QuantityChange> changes;
  const auto add = [&](const char* name, OrderStatistics CallbackSample::*quantity) {
    for (const unsigned per_mille : kQuantiles) {
      QuantityChange change{.quantity = name,
                            .per_mille = per_mille,
                            .before = quantile_interval(before.*quantity, per_mille),
                            .after = quantile_interval(after.*quantity, per_mille)};
      if (!change.before && !change.after) continue;
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

CallbackChange change_of(const CallbackSample& before, const CallbackSample& after,
                         double tolerance) {
  CallbackChange change{.logical_id = before.logical_id,
                        .is_before = true,
                        .is_after = true,
                        .instances_before = before.instances,
                        .instances_after = after.instances,
                        .quantities = quantities(before, after, tolerance),
                        .missed_before = before.missed_releases,
                        .missed_after = after.missed_releases,
                        .missed = Change::undecided,
                        .lost_isolation = before.isolation == Isolation::isolated &&
                                          after.isolation == Isolation::not_isolated,
                        .lateness_before = before.lateness,
                        .lateness_after = after.lateness};
  if (before.missed_releases && after.missed_releases) {
    change.missed =
        compare(Rate{*before.missed_releases, before.instances + *before.missed_releases},
                Rate{*after.missed_releases, after.instances + *after.missed_releases}, tolerance);
  }
  return change;
}

// Of callbacks of one id in several processes: what is worst of those that ran.
std::optional<Isolation> both(std::optional<Isolation> a, std::optional<Isolation> b) {
  if (a == Isolation::never_ran) return b;
  if (b == Isolation::never_ran) return a;
  if (a == Isolation::not_isolated || b == Isolation::not_isolated) return Isolation::not_isolated;
  return a && b ? a : std::nullopt;
}

void merge(CallbackSample& into, const CallbackSample& other) {
  into.instances += other.instances;
  into.isolation = both(into.isolation, other.isolation);
  if (other.missed_releases)
    into.missed_releases = into.missed_releases.value_or(0) + *other.missed_releases;
  if (!into.lateness || !other.lateness) {
    if (other.lateness) into.lateness = other.lateness;
    return;
  }
  into.lateness->deadline = std::min(into.lateness->deadline, other.lateness->deadline);
  into.lateness->late += other.lateness->late;
  into.lateness->instances += other.lateness->instances;
  into.lateness->max = std::max(into.lateness->max, other.lateness->max);
}

}  // namespace

OrderStatistics OrderStatistics::of(const Statistics& statistics) {
  OrderStatistics sample{.count = statistics.count(), .by_rank = {}};
  if (sample.count == 0) return sample;
  for (const unsigned per_mille : kQuantiles) {
    const auto [lower, upper] = bounding_ranks(sample.count, per_mille);
    for (const std::uint64_t rank : {lower, nearest_rank(sample.count, per_mille), upper}) {
      if (rank >= 1 && rank <= sample.count) sample.by_rank[rank] = statistics.at_rank(rank);
    }
  }
  return sample;
}

OrderStatistics OrderStatistics::of(const Summary& summary) {
  OrderStatistics sample{.count = summary.count, .by_rank = {}};
  if (summary.count == 0) return sample;
  sample.by_rank = {{1, summary.min}, {summary.count, summary.max}};
  for (const auto& [per_mille, value] : {std::pair{500U, summary.p50},
                                         {900U, summary.p90},
                                         {990U, summary.p99},
                                         {999U, summary.p99_9}}) {
    sample.by_rank.emplace(nearest_rank(summary.count, per_mille), value);
  }
  return sample;
}

std::optional<QuantileInterval> quantile_interval(const OrderStatistics& sample,
                                                  unsigned per_mille) {
  if (sample.count == 0) return std::nullopt;
  const auto estimate = sample.by_rank.find(nearest_rank(sample.count, per_mille));
  if (estimate == sample.by_rank.end()) return std::nullopt;
  const auto [lower, upper] = bounding_ranks(sample.count, per_mille);
  return QuantileInterval{.lower = largest_at_most(sample, lower),
                          .estimate = estimate->second,
                          .upper = smallest_at_least(sample, upper)};
}

std::string_view label(Change change) noexcept {
  constexpr std::array<std::string_view, 4> kLabels{"within", "better", "undecided", "worse"};
  return kLabels.at(static_cast<std::size_t>(change));
}

std::optional<Lateness> Lateness::of(const CallbackReport& callback) {
  if (!callback.response_deadline || !callback.late) return std::nullopt;
  const auto& times = callback.response_time;
  return Lateness{.deadline = *callback.response_deadline,
                  .late = *callback.late,
                  .instances = callback.instances,
                  .max = times ? std::optional(times->max) : std::nullopt};
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

void SampleCollector::on_instance(const Instance& instance) {
  if (instance.state != InstanceState::complete || !instance.end || instance.logical_id.empty()) {
    return;
  }
  const auto number = at(instance.callback);
  if (number >= measured_.size()) measured_.resize(number + 1);
  auto& measured = measured_[number];
  if (measured.logical_id.empty()) measured.logical_id = instance.logical_id;
  measured.duration.add(*instance.end - instance.start);
  if (is_known(instance.release_source) && instance.release) {
    measured.response_time.add(*response_time(instance));
    measured.start_latency.add(*start_latency(instance));
  }
}

std::vector<CallbackSample> SampleCollector::samples(const Report& report) const {
  // A timer's calculated releases may have been taken back.
  std::vector<bool> has_releases(measured_.size());
  for (const auto& callback : report.callbacks) {
    if (at(callback.index) < has_releases.size())
      has_releases[at(callback.index)] = callback.response_time.has_value();
  }
  std::map<std::string_view, Measured> by_id;
  for (std::size_t i = 0; i < measured_.size(); ++i) {
    const auto& measured = measured_[i];
    auto& sum = by_id[measured.logical_id];
    if (has_releases[i]) {
      sum.response_time.merge(measured.response_time);
      sum.start_latency.merge(measured.start_latency);
    }
    sum.duration.merge(measured.duration);
  }
  std::vector<CallbackSample> samples;
  for (const auto& callback : report.callbacks) {
    const auto& measured = by_id[callback.logical_id];
    CallbackSample sample{.logical_id = callback.logical_id,
                          .instances = callback.instances,
                          .missed_releases = callback.missed_releases,
                          .isolation = callback.isolation,
                          .response_time = OrderStatistics::of(measured.response_time),
                          .start_latency = OrderStatistics::of(measured.start_latency),
                          .duration = OrderStatistics::of(measured.duration),
                          .lateness = Lateness::of(callback)};
    const auto same = std::ranges::find(samples, sample.logical_id, &CallbackSample::logical_id);
    if (same != samples.end()) {
      merge(*same, sample);
    } else {
      samples.push_back(std::move(sample));
    }
  }
  return samples;
}

bool CallbackChange::is_regression() const {
  const auto is_worse = [](const auto& each) { return each.change == Change::worse; };
  return (is_before && !is_after) || lost_isolation || missed == Change::worse ||
         std::ranges::any_of(quantities, is_worse);
}

std::vector<CallbackChange> compare(const std::vector<CallbackSample>& before,
                                    const std::vector<CallbackSample>& after, double tolerance) {
  std::map<std::string_view, std::pair<const CallbackSample*, const CallbackSample*>> by_id;
  for (const auto& sample : before)
    by_id[sample.logical_id].first = &sample;
  for (const auto& sample : after)
    by_id[sample.logical_id].second = &sample;
  std::vector<CallbackChange> changes;
  for (const auto& [id, sides] : by_id) {
    if (sides.first != nullptr && sides.second != nullptr) {
      changes.push_back(change_of(*sides.first, *sides.second, tolerance));
      continue;
    }
    CallbackChange change;
    change.logical_id = id;
    change.is_before = sides.first != nullptr;
    change.is_after = sides.second != nullptr;
    change.instances_before = change.is_before ? sides.first->instances : 0;
    change.instances_after = change.is_after ? sides.second->instances : 0;
    changes.push_back(std::move(change));
  }
  return changes;
}

}  // namespace cie::analysis
