#include <cie/analysis/statistics.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

Statistics of(const std::vector<std::int64_t>& values) {
  Statistics statistics;
  for (const auto value : values)
    statistics.add(Duration{value});
  return statistics;
}

TEST(Statistics, OfNothingAreNotMeasured) { EXPECT_FALSE(Statistics{}.summary().has_value()); }

TEST(Statistics, CountSumAndExtremesAreExact) {
  const auto summary = *of({7, -3, 1'000'000'007, 12}).summary();
  EXPECT_EQ(summary.count, 4U);
  EXPECT_EQ(summary.min, -3);
  EXPECT_EQ(summary.max, 1'000'000'007);
  EXPECT_EQ(summary.sum, 1'000'000'023);
  EXPECT_DOUBLE_EQ(summary.mean, 1'000'000'023 / 4.0);
}

TEST(Statistics, LongValuesMayStandAmongShortOnes) {
  constexpr std::int64_t kLong = std::int64_t{1} << 32U;
  const auto summary = *of({12, kLong, 7, kLong - 1, -3}).summary();
  EXPECT_EQ(summary.count, 5U);
  EXPECT_EQ(summary.min, -3);
  EXPECT_EQ(summary.max, kLong);
  EXPECT_EQ(summary.sum, 2 * kLong + 15);
  EXPECT_EQ(summary.p50, 12);
  EXPECT_EQ(of({7, kLong}).summary()->min, 7);
  EXPECT_EQ(of({kLong, 7}).summary()->p50, 7);
}

TEST(Statistics, WhatWasMovedAwayBeginsAnew) {
  auto first = of({1, 2});
  auto second = std::move(first);
  first.add(Duration{7});  // NOLINT(bugprone-use-after-move): that it may
  EXPECT_EQ(second.summary()->sum, 3);
  EXPECT_EQ(first.summary()->sum, 7);
  first = std::move(second);
  second.add(Duration{8});  // NOLINT(bugprone-use-after-move)
  EXPECT_EQ(first.summary()->sum, 3);
  EXPECT_EQ(second.summary()->sum, 8);
}

TEST(Statistics, OneValueIsEveryQuantile) {
  const auto summary = *of({123'456'789}).summary();
  EXPECT_EQ(summary.p50, 123'456'789);
  EXPECT_EQ(summary.p99_9, 123'456'789);
}

TEST(Statistics, SumSaturatesInsteadOfWrapping) {
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(of({kMax, kMax}).summary()->sum, kMax);
  EXPECT_EQ(of({kMin, kMin}).summary()->sum, kMin);
}

TEST(Statistics, SmallValuesHaveExactNearestRankQuantiles) {
  std::vector<std::int64_t> values;  // 1..100: the p-th percentile by nearest rank is p itself
  for (std::int64_t i = 1; i <= 100; ++i)
    values.push_back(i);
  const auto summary = *of(values).summary();
  EXPECT_EQ(summary.p50, 50);
  EXPECT_EQ(summary.p90, 90);
  EXPECT_EQ(summary.p99, 99);
  EXPECT_EQ(summary.p99_9, 100);  // ceil(99.9) = 100
}

TEST(Statistics, BucketsOfShardsAddUpToThoseOfTheWhole) {
  std::mt19937_64 random(7);
  std::uniform_int_distribution<std::int64_t> value(-5'000, 3'000'000'000);
  std::vector<std::int64_t> all;
  std::map<std::int64_t, std::uint64_t> added;
  for (int shard = 0; shard < 5; ++shard) {
    std::vector<std::int64_t> values(200 + static_cast<std::size_t>(shard));
    for (auto& each : values)
      each = value(random);
    const auto summary = *of(values).summary(true);
    for (const auto& bucket : summary.buckets)
      added[bucket.value] += bucket.count;
    all.insert(all.end(), values.begin(), values.end());
  }
  const auto whole = *of(all).summary(true);
  std::map<std::int64_t, std::uint64_t> buckets;
  std::int64_t p99 = 0;
  std::uint64_t upto = 0;
  for (const auto& bucket : whole.buckets) {
    EXPECT_GT(bucket.count, 0U);
    buckets[bucket.value] = bucket.count;
    if (100 * upto < 99 * all.size()) p99 = bucket.value;  // the place is beyond those before
    upto += bucket.count;
  }
  EXPECT_EQ(added, buckets);
  EXPECT_EQ(upto, all.size());
  EXPECT_TRUE(std::ranges::is_sorted(whole.buckets, {}, &HistogramBucket::value));
  EXPECT_EQ(std::clamp(p99, whole.min, whole.max), whole.p99);
}

TEST(Statistics, BucketsAreKeptOnlyWhenAskedFor) {
  EXPECT_TRUE(of({1, 2}).summary()->buckets.empty());
}

// Few values are kept as they are, some more as the list of their buckets.
TEST(Statistics, HowManyValuesThereAreDecidesNothing) {
  std::mt19937_64 random(5);
  for (std::size_t count = 1; count <= 80; ++count) {
    std::vector<std::int64_t> values(count);
    for (auto& value : values)
      value = static_cast<std::int64_t>(random() >> (34 + random() % 24));
    const auto statistics = of(values);
    const auto summary = *statistics.summary();
    std::ranges::sort(values);
    EXPECT_EQ(summary.count, count);
    EXPECT_EQ(summary.min, values.front());
    EXPECT_EQ(summary.max, values.back());
    EXPECT_EQ(summary.sum, std::accumulate(values.begin(), values.end(), std::int64_t{0}));
    const auto expect_rank = [&](std::size_t rank, std::int64_t told) {
      const auto [least, greatest] = values_like(values[rank - 1]);
      EXPECT_LE(std::max(least, values.front()), told) << rank << " of " << count;
      EXPECT_GE(std::min(greatest, values.back()), told) << rank << " of " << count;
      EXPECT_EQ(statistics.at_rank(rank), told);
      const auto range = statistics.range_at_rank(rank);
      EXPECT_LE(range.least, values[rank - 1]);
      EXPECT_GE(range.greatest, values[rank - 1]);
    };
    expect_rank((count + 1) / 2, summary.p50);
    expect_rank((9 * count + 9) / 10, summary.p90);
    expect_rank((99 * count + 99) / 100, summary.p99);
    const auto buckets = statistics.summary(true)->buckets;
    std::uint64_t held = 0;
    for (const auto& bucket : buckets) {
      const auto [least, greatest] = values_like(bucket.value);
      std::uint64_t inside = 0;
      for (const auto value : values)
        inside += least <= value && value <= greatest ? 1 : 0;
      EXPECT_EQ(bucket.count, inside);
      held += bucket.count;
    }
    EXPECT_EQ(held, count);
  }
}

// Many values are counted several at a time, few one by one: both find the same buckets, at the edges
// of each and wherever a float would round up.
TEST(Statistics, OfManyValuesHaveTheBucketsOfEach) {
  std::vector<std::int64_t> edges;
  for (std::int64_t value = 0; value < std::int64_t{1} << 32U;) {
    const auto [least, greatest] = values_like(value);
    edges.insert(edges.end(), {least, (least + greatest) / 2, greatest});
    value = greatest + 1;
  }
  std::mt19937_64 random(7);
  for (int i = 0; i < 10'000; ++i)
    edges.push_back(static_cast<std::int64_t>(random() >> (random() % 32 + 32)));
  LogLinearHistogram each;
  for (const auto value : edges)
    each.add(value);
  EXPECT_EQ(of(edges).summary(true)->buckets, each.buckets());
  std::ranges::shuffle(edges, random);
  EXPECT_EQ(of(edges).summary(true)->buckets, each.buckets());
}

TEST(Histogram, PartsOfAnySizeAddUp) {
  std::mt19937_64 random(6);
  for (const std::size_t ours : {0U, 1U, 20U, 32U, 33U, 100U}) {
    for (const std::size_t theirs : {0U, 1U, 12U, 13U, 32U, 33U, 100U}) {
      LogLinearHistogram whole;
      LogLinearHistogram parts[2];
      for (std::size_t i = 0; i < ours + theirs; ++i) {
        const auto magnitude = static_cast<std::int64_t>(random() % 5'000);
        const auto value = random() % 2 == 0 ? magnitude : -magnitude;
        whole.add(value);
        parts[i < ours ? 0 : 1].add(value);
      }
      parts[0].merge(parts[1]);
      EXPECT_EQ(parts[0].count(), ours + theirs);
      EXPECT_EQ(parts[0].buckets(), whole.buckets()) << ours << " and " << theirs;
    }
  }
}

TEST(Statistics, NearestRankOfTwoIsTheLowerOneAtTheMedian) {
  EXPECT_EQ(of({10, 20}).summary()->p50, 10);
}

TEST(Statistics, QuantilesOfAnyMagnitudeAreWithinEightPerMille) {
  std::mt19937_64 random(1);
  std::vector<std::int64_t> values;
  for (int i = 0; i < 20'000; ++i) {
    const auto octave = random() % 60;
    const auto value = static_cast<std::int64_t>(random() >> (63 - octave) >> 1U);
    values.push_back(random() % 4 == 0 ? -value : value);
  }
  const auto summary = *of(values).summary();
  std::sort(values.begin(), values.end());
  const auto nearest_rank = [&values](double p) {
    const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(values.size())));
    return values[rank - 1];
  };
  const auto expect_close = [](std::int64_t approximate, std::int64_t exact) {
    const auto error = std::abs(static_cast<double>(approximate) - static_cast<double>(exact));
    EXPECT_LE(error, 0.008 * std::abs(static_cast<double>(exact)));
  };
  expect_close(summary.p50, nearest_rank(0.5));
  expect_close(summary.p90, nearest_rank(0.9));
  expect_close(summary.p99, nearest_rank(0.99));
}

TEST(Statistics, ExtremeIntegersDoNotOverflow) {
  constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
  constexpr auto kMax = std::numeric_limits<std::int64_t>::max();
  const auto summary = *of({kMin, kMax}).summary();
  EXPECT_EQ(summary.min, kMin);
  EXPECT_EQ(summary.max, kMax);
  EXPECT_EQ(summary.sum, -1);
}

// Every octave of either sign, so that no bucket shares its counter with another one.
TEST(Statistics, BucketsOfAllMagnitudesAreApart) {
  std::vector<std::int64_t> values;
  for (unsigned octave = 7; octave < 63; ++octave) {
    for (std::int64_t sub = 64; sub < 128; ++sub) {
      const auto value = sub << (octave - 6);  // the least of its bucket
      values.insert(values.end(), {value, -value});
    }
  }
  std::shuffle(values.begin(), values.end(), std::mt19937_64(3));
  const auto buckets = of(values).summary(true)->buckets;
  EXPECT_EQ(buckets.size(), values.size());
  for (const auto& bucket : buckets)
    EXPECT_EQ(bucket.count, 1U) << bucket.value;
}

TEST(Statistics, MergedPartsEqualTheWhole) {
  std::mt19937_64 random(2);
  Statistics whole;
  Statistics parts[3];
  for (int i = 0; i < 3'000; ++i) {
    const auto value = Duration{static_cast<std::int64_t>(random() % 10'000'000)};
    whole.add(value);
    parts[i % 3].add(value);
  }
  Statistics merged;
  for (const auto& part : parts)
    merged.merge(part);
  const auto a = *merged.summary();
  const auto b = *whole.summary();
  EXPECT_EQ(a.count, b.count);
  EXPECT_EQ(a.sum, b.sum);
  EXPECT_EQ(a.min, b.min);
  EXPECT_EQ(a.max, b.max);
  EXPECT_EQ(a.p50, b.p50);
  EXPECT_EQ(a.p99_9, b.p99_9);
}

// Below 128 every value is known exactly, whatever its sign.
TEST(Histogram, AnswersAscendingRanksInOneWalk) {
  std::vector<std::int64_t> values;
  for (std::int64_t value = -60; value < 60; value += 3) {
    for (std::int64_t times = 0; times <= (value + 60) % 4; ++times)
      values.push_back(value);
  }
  LogLinearHistogram histogram;
  histogram.add(values);
  std::vector<std::uint64_t> ranks;
  for (std::uint64_t rank = 1; rank <= values.size(); rank += 1 + rank % 3) {
    ranks.push_back(rank);
    ranks.push_back(rank);
  }
  std::vector<std::int64_t> found(ranks.size());
  histogram.at_ranks(ranks, found);
  for (std::size_t i = 0; i < ranks.size(); ++i)
    EXPECT_EQ(found[i], values[ranks[i] - 1]) << "rank " << ranks[i];
}

// In four bytes for each bucket, most of which hold little.
TEST(Histogram, CountsBeyondFourBytes) {
  LogLinearHistogram histogram;
  histogram.add(7);
  histogram.add(-3);
  for (int doubled = 0; doubled < 34; ++doubled) {
    const auto same = histogram;
    histogram.merge(same);
  }
  const auto times = std::uint64_t{1} << 34U;
  EXPECT_EQ(histogram.count(), 2 * times);
  const auto buckets = histogram.buckets();
  ASSERT_EQ(buckets.size(), 2U);
  EXPECT_EQ(buckets[0].value, -3);
  EXPECT_EQ(buckets[0].count, times);
  EXPECT_EQ(buckets[1].value, 7);
  EXPECT_EQ(buckets[1].count, times);
  EXPECT_EQ(histogram.quantile(1, 2), -3);
  EXPECT_EQ(histogram.quantile(51, 100), 7);
}

}  // namespace
}  // namespace cie::analysis
