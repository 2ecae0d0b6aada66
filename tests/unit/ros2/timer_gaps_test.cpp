// Releases of rcl's timers where not everything was seen: losses, windows, runs without an end.
#include "timer_text.hpp"

#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test::timers {
namespace {

using analysis::Verdict;

TEST(Ros2Timers, AfterALossTheGridGoesOn) {
  Text text;
  for (std::int64_t k = 1; k <= 2; ++k)
    text.run(expiry(k) + 100 * kUs);
  for (std::int64_t k = 7; k <= 9; ++k)
    text.run(expiry(k) + 100 * kUs);
  const auto result = text.analyze(expiry(5));
  EXPECT_EQ(releases(result),
            (std::vector<std::int64_t>{expiry(1), expiry(2), -1, expiry(8), expiry(9)}));
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
}

// Each lasts nearly a period, so that the next one starts at once. A packet lost the third start.
TEST(Ros2Timers, WhatIsLostWithinAPacketLeavesTheNextReleaseOpen) {
  constexpr std::int64_t kDuration = 9'300 * kUs;
  Text text;
  text.add(expiry(1) - kMs, "lost until=" + std::to_string(expiry(5)));
  for (std::int64_t k = 1; k <= 2; ++k)
    text.run(expiry(k) + 100 * kUs, kDuration);
  text.wait(expiry(3) + 100 * kUs);
  text.add(expiry(3) + 100 * kUs + kDuration, "callback_end callback=0x30");
  for (std::int64_t k = 4; k <= 7; ++k)
    text.run(expiry(k) + 100 * kUs, kDuration);
  const auto result = text.analyze(-1, deadline_us(12'000));
  for (const auto& row : result.instances) {
    if (row.release != -1) {
      EXPECT_EQ(row.release, row.start - 100 * kUs);
    }
  }
  EXPECT_EQ(releases(result).back(), expiry(7));
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive) << result.evidence("R2");
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive) << result.evidence("R3");
}

// Another callback keeps the thread from expiry 5 until 5 ms after expiry 7.
TEST(Ros2Timers, PeriodsSkippedInsideAWindowCountThere) {
  constexpr auto kLate = expiry(7) + 5 * kMs;
  Text text;
  text.add_other_timer();
  for (std::int64_t k = 1; k <= 4; ++k)
    text.run(expiry(k) + 100 * kUs);
  text.wait(expiry(5) - kMs);
  text.add(expiry(5) - kMs, "callback_start callback=0x31");
  text.add(kLate - 10 * kUs, "callback_end callback=0x31");
  text.run_next(kLate);
  for (std::int64_t k = 8; k <= 10; ++k)
    text.run(expiry(k) + 100 * kUs);
  EXPECT_EQ(text.analyze().callback(kId).missed_releases, 2U);
  for (const auto begin : {expiry(5), expiry(6), expiry(7)}) {
    const auto window = text.analyze_from(begin);
    EXPECT_EQ(window.callback(kId).missed_releases, 2U);
    EXPECT_EQ(window.verdict("R2"), Verdict::fail) << window.evidence("R2");
  }
  const auto after = text.analyze_from(expiry(8));
  EXPECT_EQ(after.verdict("R2"), Verdict::pass) << after.evidence("R2");
}

// Instance 5 is late, and nothing tells why: the timer may have been reset.
TEST(Ros2Timers, SkippedPeriodsAfterAnUnknownReleaseAreNotTold) {
  Text text;
  for (std::int64_t k = 1; k <= 4; ++k)
    text.run(expiry(k) + 100 * kUs);
  text.run(expiry(7) + 5 * kMs);
  text.run(expiry(8) + 100 * kUs);
  text.run(expiry(9) + 100 * kUs);
  const auto result = text.analyze();
  std::vector<std::optional<std::uint32_t>> missed;
  for (const auto& row : result.instances)
    missed.push_back(row.missed);
  EXPECT_THAT(missed, testing::ElementsAre(0U, 0U, 0U, 0U, std::nullopt, std::nullopt, 0U));
}

// An exception left another callback, which reset the timer before; a later reset brings the timer
// back to where it was.
TEST(Ros2Timers, WhatNeverEndsKeepsNoThreadBusy) {
  constexpr std::int64_t kMoved = 5 * kMs;
  Text text;
  for (std::int64_t k = 1; k <= 20; ++k)
    text.run(expiry(k) + 100 * kUs, 100 * kUs);
  text.wait(expiry(20) + kMoved);
  text.add(expiry(20) + kMoved, "callback_start callback=0x31");
  for (std::int64_t k = 21; k <= 50; ++k)
    text.run(expiry(k) + kMoved + 100 * kUs, 100 * kUs);
  for (std::int64_t k = 52; k <= 71; ++k)
    text.run(expiry(k) + 100 * kUs, 100 * kUs);
  const auto result = text.analyze(-1, deadline_us(3'000));
  for (const auto& row : result.instances) {
    if (row.release != -1) {
      EXPECT_EQ(row.release, row.start - 100 * kUs);
    }
  }
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive) << result.evidence("R2");
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive) << result.evidence("R3");
}

// Expiry 3 or 4 was skipped: that the release of instance 3 is known, or 2, tells not which.
TEST(Ros2Timers, PeriodsSkippedBeforeOneOfSeveralInstancesAreInTheSumAlone) {
  Text text;
  text.run(expiry(1) + 100 * kUs, 19'850 * kUs).run_next(expiry(3) + 40 * kUs, 10 * kMs);
  text.run_next(expiry(4) + 60 * kUs).run(expiry(5) + 100 * kUs);
  const auto result = text.analyze();
  std::vector<std::optional<std::uint32_t>> missed;
  for (const auto& row : result.instances)
    missed.push_back(row.missed);
  EXPECT_EQ(releases(result), (std::vector<std::int64_t>{expiry(1), expiry(2), -1, expiry(5)}));
  EXPECT_THAT(missed, testing::ElementsAre(0U, 0U, std::nullopt, std::nullopt));
  EXPECT_EQ(result.callback(kId).missed_releases, 1U);
}

}  // namespace
}  // namespace cie::test::timers
