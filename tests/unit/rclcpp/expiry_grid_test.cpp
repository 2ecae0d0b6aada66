// E(k+1) = E(k) + (1 + missed(k+1)) * period, and E is within the error of measurement.
#include "expiry_grid.hpp"

#include <cstdint>

#include <gtest/gtest.h>

namespace cie_rclcpp {
namespace {

constexpr std::int64_t kPeriod = 1'000'000;

TEST(ExpiryGrid, KeepsTheFirstMeasurementForEver) {
  ExpiryGrid grid{kPeriod};
  const std::int64_t first = 5'000'123;
  grid.begin(first, 0);
  std::int64_t expected = first;
  // Each measurement is off by something else, the number of missed periods varies.
  const std::int64_t errors[] = {0, 150, -20'000, 20'000, -1, 9'999, 77};
  const std::uint32_t missed[] = {0, 0, 3, 0, 1, 0, 12};
  for (std::size_t i = 0; i < std::size(errors); ++i) {
    const std::int64_t oldest = expected;
    expected += missed[i] * kPeriod;
    const auto expiry = grid.on_call(oldest - errors[i], expected + kPeriod + errors[i]);
    ASSERT_TRUE(expiry) << i;
    EXPECT_EQ(expiry->expiry_ns, expected) << i;
    EXPECT_EQ(expiry->missed, missed[i]) << i;
    expected += kPeriod;
  }
}

TEST(ExpiryGrid, BeginsAnewWhereAResetMovedIt) {
  ExpiryGrid grid{kPeriod};
  grid.begin(kPeriod, 0);
  EXPECT_EQ(grid.on_call(kPeriod, 2 * kPeriod)->expiry_ns, kPeriod);
  const std::int64_t moved = 2 * kPeriod + 300'000;
  const auto expiry = grid.on_call(moved, moved + kPeriod);
  EXPECT_EQ(expiry->expiry_ns, moved);
  EXPECT_EQ(expiry->missed, 0U);
  EXPECT_EQ(grid.on_call(moved + kPeriod, moved + 2 * kPeriod)->expiry_ns, moved + kPeriod);
}

// Reset at 2 and at 3 periods, it waits for 4 first: nothing was due at 2 and 3.
TEST(ExpiryGrid, AResetToTheOldGridMissesNothing) {
  ExpiryGrid grid{kPeriod};
  grid.begin(kPeriod, 0);
  EXPECT_EQ(grid.on_call(kPeriod, 2 * kPeriod)->expiry_ns, kPeriod);
  const auto expiry = grid.on_call(4 * kPeriod, 5 * kPeriod);
  EXPECT_EQ(expiry->expiry_ns, 4 * kPeriod);
  EXPECT_EQ(expiry->missed, 0U);
}

// Of the new grid 2.3 and 3.3 waited, and are one call.
TEST(ExpiryGrid, CountsWhatWasMissedSinceAReset) {
  ExpiryGrid grid{kPeriod};
  grid.begin(kPeriod, 0);
  EXPECT_EQ(grid.on_call(kPeriod, 2 * kPeriod)->expiry_ns, kPeriod);
  const std::int64_t moved = 2 * kPeriod + 300'000;
  const auto expiry = grid.on_call(moved, moved + 2 * kPeriod);
  EXPECT_EQ(expiry->expiry_ns, moved + kPeriod);
  EXPECT_EQ(expiry->missed, 1U);
}

// Due at 1, called for, and reset at 1.3 before the next expiry was measured, which is that of 2.3.
TEST(ExpiryGrid, SaysNothingWhereAResetCameBetween) {
  ExpiryGrid grid{kPeriod};
  grid.begin(kPeriod, 0);
  const std::int64_t reset = kPeriod + 300'000;
  EXPECT_FALSE(grid.on_call(kPeriod, reset + kPeriod));
  const auto expiry = grid.on_call(reset + kPeriod, reset + 2 * kPeriod);
  EXPECT_EQ(expiry->expiry_ns, reset + kPeriod);
  EXPECT_EQ(expiry->missed, 0U);
}

TEST(ExpiryGrid, BeginsAnewJustBeyondTheTolerance) {
  for (const std::int64_t off : {20'000, 20'001}) {
    ExpiryGrid grid{kPeriod};
    grid.begin(10 * kPeriod, 0);
    EXPECT_EQ(grid.on_call(10 * kPeriod + off, 11 * kPeriod + off)->expiry_ns,
              10 * kPeriod + (off > 20'000 ? off : 0));
  }
}

TEST(ExpiryGrid, ToleratesAQuarterOfAShortPeriod) {
  constexpr std::int64_t kShort = 40'000;
  ExpiryGrid near{kShort};
  near.begin(kShort, 0);
  EXPECT_EQ(near.on_call(kShort + 10'000, 2 * kShort + 10'000)->expiry_ns, kShort);
  ExpiryGrid far{kShort};
  far.begin(kShort, 0);
  EXPECT_EQ(far.on_call(kShort + 10'001, 2 * kShort + 10'001)->expiry_ns, kShort + 10'001);
}

// What was called for already is no expiry again.
TEST(ExpiryGrid, NeverGoesBack) {
  ExpiryGrid grid{kPeriod};
  grid.begin(5 * kPeriod, 0);
  EXPECT_EQ(grid.on_call(5 * kPeriod, 6 * kPeriod)->expiry_ns, 5 * kPeriod);
  EXPECT_FALSE(grid.on_call(5 * kPeriod, 6 * kPeriod));
}

TEST(ExpiryGrid, KnowsNothingBeforeTheFirstCall) {
  ExpiryGrid grid{kPeriod};
  const auto expiry = grid.on_call(6 * kPeriod + 5, 7 * kPeriod + 5);
  EXPECT_EQ(expiry->expiry_ns, 6 * kPeriod + 5);
  EXPECT_EQ(expiry->missed, 0U);
}

// Served from 9.4 periods on, when the expiries 5 to 9 wait, which are one call: of these 9 is the release.
TEST(ExpiryGrid, WhatExpiredBeforeItWasServedWasMissedByNobody) {
  ExpiryGrid grid{kPeriod};
  grid.begin(5 * kPeriod, 9 * kPeriod + 400'000);
  const auto first = grid.on_call(5 * kPeriod, 10 * kPeriod);
  EXPECT_EQ(first->expiry_ns, 9 * kPeriod);
  EXPECT_EQ(first->missed, 0U);
  grid.begin(5 * kPeriod, 9 * kPeriod + 400'000);
  const auto late = grid.on_call(5 * kPeriod, 12 * kPeriod);
  EXPECT_EQ(late->expiry_ns, 11 * kPeriod);
  EXPECT_EQ(late->missed, 2U) << "10, and 9, which waited when the serving began";
}

TEST(ExpiryGrid, SaysNoMoreThanFitsOfWhatWasMissed) {
  ExpiryGrid grid{1};
  grid.begin(1, 0);
  EXPECT_EQ(grid.on_call(1, 10'000'000'000)->missed, 4'294'967'295U);
}

}  // namespace
}  // namespace cie_rclcpp
