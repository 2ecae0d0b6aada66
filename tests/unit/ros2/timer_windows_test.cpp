// Releases of rcl's timers in a part of a recording: what proves or refutes the grid may lie outside of it.
#include "timer_text.hpp"

#include <gtest/gtest.h>

namespace cie::test::timers {
namespace {

using analysis::Timestamp;
using analysis::Verdict;

constexpr std::int64_t kReset = 50;  // the first expiry after it

// 20 instances start 100 us after their expiries; then the timer is cancelled for a while, and reset to where 20 others
// start 600 us after them. Instances 10 and 60 take so long that a period is skipped.
Text reset_once() {
  Text text;
  const auto run = [&text](std::int64_t first, std::int64_t latency) {
    constexpr std::int64_t kLong = 23 * kMs;
    const auto slow = first + 10 - first % 10;
    for (auto k = first; k < slow; ++k)
      text.run(expiry(k) + latency);
    text.run(expiry(slow) + latency, kLong);
    text.run_next(expiry(slow) + latency + kLong + kUs);
    for (auto k = slow + 3; k < first + 21; ++k)
      text.run(expiry(k) + latency);
  };
  run(1, 100 * kUs);
  run(kReset, 600 * kUs);
  return text;
}

TEST(Ros2TimerWindows, DecideNothingThatTheWholeDoesNot) {
  const auto text = reset_once();
  EXPECT_EQ(text.analyze().verdict("R2"), Verdict::inconclusive);
  for (const auto& window :
       {analysis::TimeWindow{.to = Timestamp{expiry(kReset - 5)}},
        analysis::TimeWindow{.from = Timestamp{expiry(kReset - 5)}},
        analysis::TimeWindow{.from = Timestamp{expiry(5)}, .to = Timestamp{expiry(18)}}}) {
    const auto result = text.analyze_in(window);
    for (const auto* rule : {"R1", "R2"})
      EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule << result.evidence(rule);
    EXPECT_FALSE(result.callback(kId).missed_releases);
  }
}

TEST(Ros2TimerWindows, CountWhatIsUnprovenInsideAlone) {
  Text text;
  for (std::int64_t k = 1; k <= 4; ++k)
    text.run(expiry(k) + 100 * kUs);
  text.run(expiry(5) + 5 * kMs);  // late, and nothing tells why
  for (std::int64_t k = 6; k <= 20; ++k)
    text.run(expiry(k) + 100 * kUs);
  EXPECT_EQ(text.analyze().verdict("R2"), Verdict::inconclusive);
  const auto after = text.analyze_from(expiry(7));
  EXPECT_EQ(after.verdict("R2"), Verdict::pass) << after.evidence("R2");
  const auto before = text.analyze_in({.to = Timestamp{expiry(5)}});
  EXPECT_EQ(before.verdict("R2"), Verdict::pass) << before.evidence("R2");
}

// What let instances start late ran before the window, or what proves them comes after it.
TEST(Ros2TimerWindows, LookAtWhatIsOutside) {
  Text text;
  text.add_other_timer();
  for (std::int64_t k = 1; k <= 4; ++k)
    text.run(expiry(k) + 100 * kUs);
  text.wait(expiry(5) - kMs).add(expiry(5) - kMs, "callback_start callback=0x31");
  text.add(expiry(5) + 3 * kMs, "callback_end callback=0x31");
  text.run_next(expiry(5) + 3 * kMs + kUs);
  for (std::int64_t k = 6; k <= 9; ++k)
    text.run(expiry(k) + 100 * kUs);
  const auto from = text.analyze_from(expiry(5) + 3 * kMs - kUs);
  EXPECT_EQ(releases(from).front(), expiry(5));
  EXPECT_EQ(from.callback(kId).missed_releases, 0U);
  const auto to = text.analyze_in({.to = Timestamp{expiry(6)}});
  EXPECT_EQ(releases(to).back(), expiry(5));
  EXPECT_EQ(to.callback(kId).missed_releases, 0U);
}

}  // namespace
}  // namespace cie::test::timers
