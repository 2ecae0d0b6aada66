// What two samples allow to say about each other.
#include <cie/analysis/comparison.hpp>

#include "studies/binomial.hpp"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// Values first, first + 1, …: ranks are known without looking.
Statistics ramp(std::int64_t first, std::int64_t count) {
  Statistics statistics;
  for (std::int64_t i = 0; i < count; ++i)
    statistics.add(Duration{first + i});
  return statistics;
}

CallbackSample sample(std::int64_t first, std::int64_t count) {
  CallbackSample result;
  result.logical_id = "/a";
  result.instances = static_cast<std::uint64_t>(count);
  result.isolation = Isolation::isolated;
  result.response_time = OrderStatistics::of(ramp(first, count));
  return result;
}

// 0.5^4 times 1, 4, 6, 4, 1.
TEST(Binomial, IsExactForFewTrials) {
  EXPECT_NEAR(binomial_cdf(4, 0.5, 0), 1 / 16.0, 1e-12);
  EXPECT_NEAR(binomial_cdf(4, 0.5, 2), 11 / 16.0, 1e-12);
  EXPECT_EQ(binomial_cdf(4, 0.5, 4), 1);
  EXPECT_EQ(binomial_cdf(4, 0.5, -1), 0);
  EXPECT_EQ(binomial_quantile(4, 0.5, 0.5), 2);
  EXPECT_EQ(binomial_quantile(4, 0.5, 0.01), 0);
}

// 0.99^100 = 0.36603…: no underflow of the tail, and one at 10 000 that stays finite.
TEST(Binomial, HasTails) {
  EXPECT_NEAR(binomial_cdf(100, 0.01, 0), std::pow(0.99, 100), 1e-12);
  EXPECT_NEAR(binomial_cdf(20'000, 0.5, 10'000) + binomial_cdf(20'000, 0.5, 9'999), 1, 1e-9);
}

TEST(Binomial, IsContinuousWhereItBecomesNormal) {
  // Variances just below and above the bound, at the same deviation from the mean.
  const double exact = binomial_cdf(39'999, 0.5, 19'999 - 100);
  const double normal = binomial_cdf(40'001, 0.5, 20'000 - 100);
  EXPECT_NEAR(exact, normal, 0.005);
}

TEST(QuantileInterval, ContainsTheEstimate) {
  const auto interval = quantile_interval(OrderStatistics::of(ramp(0, 101)), 500);
  ASSERT_TRUE(interval && interval->lower && interval->upper);
  EXPECT_EQ(interval->estimate, 50);  // the 51st of 0 … 100
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
  const QuantileInterval before{.lower = 100, .estimate = 105, .upper = 110};
  const auto after = [&](std::int64_t lower, std::int64_t upper) {
    return compare(before, QuantileInterval{.lower = lower, .estimate = lower, .upper = upper},
                   0.1);
  };
  EXPECT_EQ(after(122, 130), Change::worse);      // above 110 * 1.1
  EXPECT_EQ(after(121, 130), Change::undecided);  // not above
  EXPECT_EQ(after(90, 110), Change::within);      // at most 100 * 1.1
  EXPECT_EQ(after(80, 90), Change::better);       // 99 is below 100
}

TEST(Compare, WithoutBoundsNothingIsCertain) {
  const QuantileInterval known{.lower = 1, .estimate = 2, .upper = 3};
  const QuantileInterval unknown{.lower = std::nullopt, .estimate = 1'000, .upper = std::nullopt};
  EXPECT_EQ(compare(known, unknown, 0), Change::undecided);
  EXPECT_EQ(compare(unknown, known, 0), Change::undecided);
}

// 10 events more of 1000 trials each may be chance, 60 more are not.
TEST(Compare, CountsRatesBeyondChance) {
  const Rate before{.events = 20, .trials = 1000};
  EXPECT_EQ(compare(before, Rate{.events = 30, .trials = 1000}, 0), Change::undecided);
  EXPECT_EQ(compare(before, Rate{.events = 80, .trials = 1000}, 0), Change::worse);
  EXPECT_EQ(compare(Rate{.events = 80, .trials = 1000}, before, 0), Change::better);
  EXPECT_EQ(compare(Rate{.events = 0, .trials = 9}, Rate{.events = 0, .trials = 9}, 0),
            Change::within);
  EXPECT_EQ(compare(Rate{.events = 0, .trials = 0}, Rate{.events = 5, .trials = 9}, 0),
            Change::undecided);
}

TEST(Compare, FindsTheCallbackThatBecameSlower) {
  const auto changes = compare({sample(1'000'000, 2'000)}, {sample(2'000'000, 2'000)}, 0.05);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_TRUE(changes.front().is_regression());
  EXPECT_EQ(changes.front().quantities.front().change, Change::worse);
  EXPECT_FALSE(compare({sample(1'000'000, 2'000)}, {sample(1'000'000, 2'000)}, 0.05)
                   .front()
                   .is_regression());
  EXPECT_FALSE(
      compare({sample(1'000'000, 3)}, {sample(2'000'000, 3)}, 0.05).front().is_regression());
}

TEST(Compare, MissesWhatIsGoneAndNoticesLostIsolation) {
  auto other = sample(0, 10);
  other.logical_id = "/b";
  const auto changes = compare({sample(0, 10)}, {other}, 0.05);
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].is_regression()) << "/a is gone";
  EXPECT_FALSE(changes[1].is_regression()) << "/b is new";
  auto shared = sample(0, 10);
  shared.isolation = Isolation::not_isolated;
  EXPECT_TRUE(compare({sample(0, 10)}, {shared}, 0.05).front().lost_isolation);
}

TEST(Compare, HoldsBothSidesAgainstTheDeadline) {
  CallbackReport report;
  EXPECT_EQ(Lateness::of(report), std::nullopt) << "no deadline";
  report.response_deadline = Duration{100};
  report.late = 3;
  report.instances = 8;
  report.response_time = Summary{.count = 8, .max = 170};
  const Lateness expected{.deadline = {100}, .late = 3, .instances = 8, .max = 170};
  EXPECT_EQ(Lateness::of(report), expected);
  auto before = sample(1, 10);
  before.lateness = expected;
  const auto changes = compare({before}, {sample(1, 10)}, 0.05);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].lateness_before, expected);
  EXPECT_EQ(changes[0].lateness_after, std::nullopt);
}

TEST(Compare, DoesNotAccuseWhatNeverRanOfSharing) {
  auto idle = sample(0, 0);
  for (const auto isolation : {std::optional(Isolation::never_ran), std::optional<Isolation>()}) {
    idle.isolation = isolation;
    EXPECT_FALSE(compare({sample(0, 10)}, {idle}, 0.05).front().lost_isolation);
  }
}

}  // namespace
}  // namespace cie::analysis
