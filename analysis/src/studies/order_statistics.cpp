#include <cie/analysis/comparison.hpp>

#include "binomial.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

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

std::optional<std::int64_t> lower_bound_at(const OrderStatistics& sample, std::uint64_t rank) {
  const auto after = sample.at_least.upper_bound(rank);
  if (after == sample.at_least.begin()) return std::nullopt;
  return std::prev(after)->second;
}

std::optional<std::int64_t> upper_bound_at(const OrderStatistics& sample, std::uint64_t rank) {
  const auto found = sample.at_most.lower_bound(rank);
  if (found == sample.at_most.end()) return std::nullopt;
  return found->second;
}

// How many values may be less than `value`.
std::uint64_t most_below(const OrderStatistics& sample, std::int64_t value) {
  for (const auto& [rank, known] : sample.at_least) {
    if (known >= value) return rank - 1;
  }
  return sample.count;
}

// How many values are no more than `value`, at least.
std::uint64_t least_up_to(const OrderStatistics& sample, std::int64_t value) {
  std::uint64_t count = 0;
  for (const auto& [rank, known] : sample.at_most) {
    if (known <= value) count = rank;
  }
  return count;
}

// As near as the next bucket.
bool is_known(const OrderStatistics& sample, std::uint64_t rank) {
  const auto least = lower_bound_at(sample, rank);
  const auto most = upper_bound_at(sample, rank);
  return least && most && values_like(*most).least - 1 <= values_like(*least).greatest;
}

void know(OrderStatistics& sample, std::uint64_t rank, const ValueRange& range) {
  sample.at_least[rank] = range.least;
  sample.at_most[rank] = range.greatest;
}

}  // namespace

OrderStatistics OrderStatistics::of(const Statistics& statistics) {
  return of(statistics, statistics);
}

OrderStatistics OrderStatistics::of(const Statistics& at_least, const Statistics& at_most) {
  OrderStatistics sample;
  sample.count = at_least.count();
  if (sample.count == 0) return sample;
  // That some are known at all.
  if (const auto bounded = at_most.count(); bounded > 0 && bounded < sample.count)
    sample.at_most[bounded] = at_most.range_at_rank(bounded).greatest;
  for (const unsigned per_mille : kComparedQuantiles) {
    const auto nearest = nearest_rank(sample.count, per_mille);
    const auto [lower, upper] = bounding_ranks(sample.count, per_mille);
    for (const std::uint64_t rank : {lower, nearest, upper}) {
      if (rank < 1 || rank > sample.count) continue;
      sample.at_least[rank] = at_least.range_at_rank(rank).least;
      if (rank <= at_most.count()) sample.at_most[rank] = at_most.range_at_rank(rank).greatest;
    }
    sample.estimates[per_mille] = {.ns = at_least.at_rank(nearest),
                                   .is_bound = !is_known(sample, nearest)};
  }
  return sample;
}

OrderStatistics OrderStatistics::of(const Rare<Summary>& summary) {
  OrderStatistics sample;
  if (!summary || summary->count == 0) return sample;
  sample.count = summary->count;
  for (const auto& [per_mille, value] : {std::pair{500U, summary->p50},
                                         {900U, summary->p90},
                                         {990U, summary->p99},
                                         {999U, summary->p99_9}}) {
    sample.estimates[per_mille] = {.ns = value};
    const auto [least, greatest] = values_like(value);
    know(sample, nearest_rank(summary->count, per_mille),
         {.least = std::max(least, summary->min), .greatest = std::min(greatest, summary->max)});
  }
  know(sample, 1, {.least = summary->min, .greatest = summary->min});
  know(sample, summary->count, {.least = summary->max, .greatest = summary->max});
  return sample;
}

// Of each value that is known of either: so many of both are less at most, so many are no more at
// least.
OrderStatistics merged(const OrderStatistics& a, const OrderStatistics& b) {
  if (a.count == 0) return b;
  if (b.count == 0) return a;
  OrderStatistics both;
  both.count = a.count + b.count;
  for (const auto* side : {&a, &b}) {
    for (const auto& [rank, value] : side->at_least) {
      const auto below = most_below(a, value) + most_below(b, value);
      if (below >= both.count) continue;
      const auto [known, is_new] = both.at_least.emplace(below + 1, value);
      if (!is_new) known->second = std::max(known->second, value);
    }
    for (const auto& [rank, value] : side->at_most) {
      const auto up_to = least_up_to(a, value) + least_up_to(b, value);
      if (up_to == 0) continue;
      const auto [known, is_new] = both.at_most.emplace(up_to, value);
      if (!is_new) known->second = std::min(known->second, value);
    }
  }
  for (const unsigned per_mille : kComparedQuantiles) {
    const auto rank = nearest_rank(both.count, per_mille);
    const auto most = upper_bound_at(both, rank);
    const auto least = lower_bound_at(both, rank);
    if (most || least) {
      both.estimates[per_mille] = {.ns = most ? *most : *least, .is_bound = !most};
    }
  }
  return both;
}

OrderStatistics OrderStatistics::of_response_time(const CallbackReport& callback) {
  const auto known = of(callback.response_time);
  auto all = merged(known, of(callback.response_time_lower));
  all.at_most = merged(known, of(callback.response_time_upper)).at_most;
  const auto at_least = of(callback.response_time_at_least);
  for (const auto& [rank, value] : at_least.at_least) {
    const auto [least, is_new] = all.at_least.emplace(rank, value);
    least->second = std::max(least->second, value);
  }
  if (at_least.count > 0) all.estimates = at_least.estimates;
  const bool is_told = at_least.count > 0 || known.count == 0;
  for (auto& [per_mille, estimate] : all.estimates) {
    const auto rank = nearest_rank(all.count, per_mille);
    estimate.is_bound = per_mille == 500 && callback.is_median_known ? !*callback.is_median_known
                                                                     : !is_known(all, rank);
    if (estimate.is_bound && !is_told) estimate.ns = *lower_bound_at(all, rank);
  }
  return all;
}

OrderStatistics OrderStatistics::of_start_latency(const CallbackReport& callback) {
  auto known = of(callback.start_latency);
  const auto all = callback.duration ? callback.duration->count : 0;
  if (all <= known.count) return known;
  OrderStatistics unknown{
      .count = all - known.count, .at_least = {{1, 0}}, .at_most = {}, .estimates = {}};
  for (const unsigned per_mille : kComparedQuantiles)
    unknown.estimates[per_mille] = {.ns = 0, .is_bound = true};
  return merged(known, unknown);
}

std::optional<QuantileInterval> quantile_interval(const OrderStatistics& sample,
                                                  unsigned per_mille) {
  const auto estimate = sample.estimates.find(per_mille);
  if (sample.count == 0 || estimate == sample.estimates.end()) return std::nullopt;
  const auto [lower, upper] = bounding_ranks(sample.count, per_mille);
  return QuantileInterval{.lower = lower_bound_at(sample, lower),
                          .estimate = estimate->second,
                          .upper = upper_bound_at(sample, upper)};
}

}  // namespace cie::analysis
