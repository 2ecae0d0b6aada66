// What is certain of the quantiles of a sample.
#include "compared_callbacks.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

TEST(QuantileInterval, ContainsTheEstimate) {
  const auto interval = quantile_interval(OrderStatistics::of(ramp(0, 101)), 500);
  ASSERT_TRUE(interval && interval->lower && interval->upper);
  EXPECT_EQ(interval->estimate.ns, 50);  // the 51st of 0 … 100
  EXPECT_LT(*interval->lower, 50);
  EXPECT_GT(*interval->upper, 50);
}

// P(no value of n above the quantile) = 0.99^n falls below 0.0005 at n = 757.
TEST(QuantileInterval, HasNoUpperBoundOfATailThatTheSampleDoesNotReach) {
  EXPECT_FALSE(quantile_interval(OrderStatistics::of(ramp(0, 700)), 990)->upper);
  EXPECT_TRUE(quantile_interval(OrderStatistics::of(ramp(0, 800)), 990)->upper);
}

TEST(QuantileInterval, OfNothingIsNothing) {
  EXPECT_FALSE(quantile_interval(OrderStatistics{}, 500));
}

TEST(Compare, IsCertainOnlyOfWhatLiesApart) {
  const QuantileInterval before{.lower = 100, .estimate = {.ns = 105}, .upper = 110};
  const auto after = [&](std::int64_t lower, std::int64_t upper) {
    return compare(
        before, QuantileInterval{.lower = lower, .estimate = {.ns = lower}, .upper = upper}, 0.1);
  };
  EXPECT_EQ(after(122, 130), Change::worse);      // above 110 * 1.1
  EXPECT_EQ(after(121, 130), Change::undecided);  // not above
  EXPECT_EQ(after(90, 110), Change::within);      // at most 100 * 1.1
  EXPECT_EQ(after(80, 90), Change::better);       // 99 is below 100
}

// As with clocks that disagree: the tolerance is of what lies between it and 0.
TEST(Compare, ToleratesAsMuchOfNegativeValues) {
  const QuantileInterval before{.lower = -110, .estimate = {.ns = -105}, .upper = -100};
  EXPECT_EQ(compare(before, before, 0.1), Change::within);
  const auto after = [&](std::int64_t lower, std::int64_t upper) {
    return compare(
        before, QuantileInterval{.lower = lower, .estimate = {.ns = lower}, .upper = upper}, 0.1);
  };
  EXPECT_EQ(after(-89, -85), Change::worse);     // above -100 + 10
  EXPECT_EQ(after(-130, -122), Change::within);  // -122 + 12.2 is above -110
  EXPECT_EQ(after(-130, -124), Change::better);  // -124 + 12.4 is below
}

TEST(Compare, WithoutBoundsNothingIsCertain) {
  const QuantileInterval known{.lower = 1, .estimate = {.ns = 2}, .upper = 3};
  const QuantileInterval unknown{
      .lower = std::nullopt, .estimate = {.ns = 1'000}, .upper = std::nullopt};
  EXPECT_EQ(compare(known, unknown, 0), Change::undecided);
  EXPECT_EQ(compare(unknown, known, 0), Change::undecided);
}

// 8'317 and 8'321 are 0.05 % apart, on two sides of 8'320, the edge of a bucket of 128.
TEST(Compare, TrustsNoMoreThanTheEdgesOfBuckets) {
  const auto around = [](std::int64_t median) {
    Statistics statistics;
    for (std::int64_t i = 0; i < 1'000; ++i)
      statistics.add(Duration{i < 10 ? 8'000 : i < 990 ? median : 9'000});
    auto result = sample(0, 1'000);
    result.response_time = OrderStatistics::of(statistics);
    return result;
  };
  const auto median = [&](std::int64_t before, std::int64_t after, double tolerance) {
    return compared(around(before), around(after), tolerance).callbacks.at(0).quantities.at(0);
  };
  EXPECT_EQ(median(8'317, 8'321, 0.01).change, Change::undecided);
  EXPECT_EQ(median(8'317, 8'321, 0.05).change, Change::within);
  EXPECT_EQ(median(8'317, 8'800, 0.03).change, Change::worse);
  const auto interval = median(8'317, 8'321, 0.01).after;
  ASSERT_TRUE(interval);
  EXPECT_EQ(interval->lower, 8'320);
  EXPECT_EQ(interval->upper, 8'320 + 127);
}

// Values below 128 have buckets of their own; 200 lies in 200 .. 201, -200 in -201 .. -200.
TEST(ValuesLike, HaveTheEdgesOfABucket) {
  const auto edges = [](std::int64_t value) {
    const auto range = values_like(value);
    return std::pair(range.least, range.greatest);
  };
  using Edges = std::pair<std::int64_t, std::int64_t>;
  EXPECT_EQ(edges(127), Edges(127, 127));
  EXPECT_EQ(edges(201), Edges(200, 201));
  EXPECT_EQ(edges(-200), Edges(-201, -200));
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(edges(kMost).second, kMost);
  EXPECT_EQ(edges(-kMost - 1).first, -kMost - 1);
}

// 1 … 100 and 201 … 300: of all 200 the 100 greatest are above 200, and 100 are at most 100.
TEST(OrderStatistics, OfTwoReportsBoundThoseOfBoth) {
  const auto of = [](std::int64_t first) {
    return OrderStatistics::of(*ramp(first, 100).summary());
  };
  const auto both = merged(of(1), of(201));
  EXPECT_EQ(both.count, 200U);
  EXPECT_EQ(both.at_most.at(100), 100);
  EXPECT_EQ(both.at_least.at(101), 201);
  EXPECT_EQ(both.at_least.at(200), 300);
  EXPECT_EQ(merged(of(1), OrderStatistics{}).at_most, of(1).at_most);
}

// 100 instances took 1 us; of 200 nobody knows more than that they took 9 us at least.
TEST(OrderStatistics, TakeWhatIsBoundedIntoAccount) {
  const auto times = [](std::uint64_t count, std::int64_t ns) {
    Statistics statistics;
    for (std::uint64_t i = 0; i < count; ++i)
      statistics.add(Duration{ns});
    return statistics;
  };
  const auto known = times(100, 1'000);
  auto at_least = known;
  at_least.merge(times(200, 9'000));
  CallbackReport report;
  report.response_time = known.summary();
  report.response_time_lower = times(200, 9'000).summary();
  report.start_latency = times(100, 10).summary();
  report.duration = times(300, 900).summary();
  const auto without_key = OrderStatistics::of_response_time(report);
  report.response_time_at_least = at_least.summary();
  for (const auto& sample : {OrderStatistics::of(at_least, known), without_key,
                             OrderStatistics::of_response_time(report)}) {
    const auto median = quantile_interval(sample, 500);
    ASSERT_TRUE(median && median->lower);
    EXPECT_GE(*median->lower, values_like(9'000).least);
    EXPECT_GE(median->estimate.ns, values_like(9'000).least);
    EXPECT_EQ(median->upper, std::nullopt);
    EXPECT_TRUE(median->estimate.is_bound);
    EXPECT_EQ(compare(*quantile_interval(OrderStatistics::of(times(300, 1'000)), 500), *median, 1),
              Change::worse);
  }
  auto sample_of_some = sample(0, 300);
  sample_of_some.response_time = OrderStatistics::of(at_least, known);
  const auto same = change(sample_of_some, sample_of_some);
  ASSERT_EQ(same.quantities.size(), 2U);
  EXPECT_EQ(same.quantities[0].change, Change::undecided) << "and not left out";
  const auto start = quantile_interval(OrderStatistics::of_start_latency(report), 500);
  ASSERT_TRUE(start);
  EXPECT_EQ(start->lower, 0);
  EXPECT_EQ(start->upper, std::nullopt);
}

// Of 60 of 80 instances the release is known, and the others took longer: the 40th is among the former.
TEST(OrderStatistics, KnowAMedianThatMostRunsShow) {
  auto at_least = ramp(1, 60);
  at_least.merge(ramp(100, 20));
  CallbackReport report;
  report.response_time = ramp(1, 60).summary();
  report.response_time_lower = ramp(100, 20).summary();
  report.response_time_at_least = at_least.summary();
  report.is_median_known = true;
  const auto median = OrderStatistics::of_response_time(report).estimates.at(500);
  EXPECT_EQ(median, (QuantileEstimate{.ns = 40, .is_bound = false}));
}

}  // namespace
}  // namespace cie::analysis
