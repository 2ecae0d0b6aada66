#include "silence.hpp"

#include <chrono>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using namespace std::chrono_literals;

constexpr Silence::Clock::time_point kHeard{1h};

// Listens every fifth of a second.
Silence::Clock::time_point listen(Silence& silence, Silence::Clock::time_point from, int times) {
  for (int i = 0; i < times; ++i)
    silence.listen(from += 200ms);
  return from;
}

TEST(Silence, IsTheTimeSinceSomethingWasHeard) {
  Silence silence(kHeard);
  const auto now = listen(silence, kHeard, 15);
  EXPECT_EQ(silence.duration(), 3s);
  silence.heard(false);
  EXPECT_EQ(silence.duration(), 0s);
  listen(silence, now, 5);
  EXPECT_EQ(silence.duration(), 1s);
}

TEST(Silence, TimeInWhichNobodyListenedIsNoSilence) {
  Silence silence(kHeard);
  silence.listen(kHeard + 12s);
  EXPECT_EQ(silence.duration(), Silence::kLongestStep);
}

TEST(Silence, WhoSaidToBeBusyMayBeSilent) {
  Silence silence(kHeard);
  silence.heard(true);
  const auto now = listen(silence, kHeard, 50);
  EXPECT_EQ(silence.duration(), 0s);
  silence.heard(false);
  listen(silence, now, 5);
  EXPECT_EQ(silence.duration(), 1s);
}

}  // namespace
}  // namespace cie::live
