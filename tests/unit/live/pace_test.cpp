#include "pace.hpp"

#include <chrono>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using namespace std::chrono_literals;

constexpr Pace::Clock::time_point kBegin{1h};

TEST(Pace, IsTheIntervalWhereLooksCostLittle) {
  Pace pace(1s, kBegin);
  EXPECT_FALSE(pace.is_due(kBegin + 999ms));
  EXPECT_TRUE(pace.is_due(kBegin + 1s));
  pace.looked(kBegin + 1100ms, 50ms);
  EXPECT_FALSE(pace.is_due(kBegin + 1999ms)) << "looks do not drift by what they take";
  EXPECT_TRUE(pace.is_due(kBegin + 2s));
}

TEST(Pace, ALookTakesATenthOfTheTimeAtMost) {
  Pace pace(1s, kBegin);
  pace.looked(kBegin + 2s, 400ms);
  EXPECT_FALSE(pace.is_due(kBegin + 5999ms));
  EXPECT_TRUE(pace.is_due(kBegin + 6s));
}

TEST(Pace, IsStretchedToHalfAMinuteAtMost) {
  Pace pace(1s, kBegin);
  pace.looked(kBegin + 2s, 20s);
  EXPECT_FALSE(pace.is_due(kBegin + 31s));
  EXPECT_TRUE(pace.is_due(kBegin + 32s));
}

TEST(Pace, WhatHeldTheLookerUpIsNeitherStretchedNorMadeUpFor) {
  Pace pace(1s, kBegin);
  pace.looked(kBegin + 15s, 1ms);  // fourteen seconds late, and cheap
  EXPECT_FALSE(pace.is_due(kBegin + 15s + 9ms));
  EXPECT_TRUE(pace.is_due(kBegin + 15s + 10ms));
  pace.looked(kBegin + 15s + 10ms, 1ms);
  EXPECT_FALSE(pace.is_due(kBegin + 16s));
  EXPECT_TRUE(pace.is_due(kBegin + 16s + 10ms));
}

TEST(Pace, ALookThatIsHastenedIsDueAtOnce) {
  Pace pace(10s, kBegin);
  pace.hasten(kBegin + 2s);
  EXPECT_TRUE(pace.is_due(kBegin + 2s));
}

}  // namespace
}  // namespace cie::live
