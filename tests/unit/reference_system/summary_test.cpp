// The statistics that the reference system prints of itself.
#include "key_figures.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace autoware {
namespace {

TEST(Summary, OfNothingIsZero) {
  const Summary summary = summarize({});
  EXPECT_EQ(summary.count, 0U);
  EXPECT_EQ(summary.greatest, 0);
}

TEST(Summary, OfOneValueHasNoDeviation) {
  const Summary summary = summarize({7});
  EXPECT_DOUBLE_EQ(summary.mean, 7);
  EXPECT_DOUBLE_EQ(summary.deviation, 0);
  EXPECT_EQ(summary.p99, 7);
}

// 2, 4, 4, 4, 5, 5, 7, 9: mean 5, squares of the differences sum to 32.
TEST(Summary, HasTheDeviationOfASample) {
  const Summary summary = summarize({9, 2, 4, 5, 4, 5, 7, 4});
  EXPECT_DOUBLE_EQ(summary.mean, 5);
  EXPECT_DOUBLE_EQ(summary.deviation, std::sqrt(32.0 / 7));
  EXPECT_EQ(summary.least, 2);
  EXPECT_EQ(summary.greatest, 9);
}

// Of 1 … 200 the 99th percentile by nearest rank is the 198th.
TEST(Summary, TakesThePercentileByNearestRank) {
  std::vector<std::int64_t> values(200);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = static_cast<std::int64_t>(values.size() - i);
  EXPECT_EQ(summarize(values).p99, 198);
}

}  // namespace
}  // namespace autoware
