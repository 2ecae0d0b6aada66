// Releases of rcl's timers, which no event tells: on a grid that begins when the timer is made.
#include "timer_text.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test::timers {
namespace {

using analysis::ReleaseSource;
using analysis::Verdict;
using testing::HasSubstr;

TEST(Ros2Timers, ReleasesFollowFromWhenTheTimerWasMade) {
  Text text;
  for (std::int64_t k = 1; k <= 4; ++k)
    text.run(expiry(k) + 100 * kUs);
  const auto result = text.analyze();
  EXPECT_EQ(releases(result), (std::vector{expiry(1), expiry(2), expiry(3), expiry(4)}));
  const auto& timer = result.callback(kId);
  EXPECT_EQ(timer.release_source, ReleaseSource::timer_grid);
  EXPECT_EQ(timer.start_latency->max, 100 * kUs);
  EXPECT_EQ(timer.response_time->min, 1'100 * kUs);
  EXPECT_EQ(timer.inter_arrival->min, kPeriod);
  EXPECT_EQ(timer.inter_arrival->max, kPeriod);
  EXPECT_EQ(timer.missed_releases, 0U);
  EXPECT_FALSE(timer.response_time_lower);
  EXPECT_EQ(result.verdict("R1"), Verdict::pass);
  EXPECT_EQ(result.verdict("R2"), Verdict::pass);
}

// Between rcl's look at the clock and its event a thread may be preempted; its event before bounds that.
TEST(Ros2Timers, AThreadMayHaveBeenPreemptedAsTheTimerWasMade) {
  const auto verdicts = [](std::int64_t before, std::int64_t deadline) {
    Text text(true, "0x10", before);
    for (std::int64_t k = 1; k <= 4; ++k)
      text.run(expiry(k) + 100 * kUs);
    return text.analyze(-1, deadline_us(deadline)).verdict("R3");
  };
  // The response time is 1100 us, to 100 us.
  EXPECT_EQ(verdicts(10 * kUs, 1200), Verdict::pass);
  EXPECT_EQ(verdicts(11 * kUs, 1200), Verdict::inconclusive);
  EXPECT_EQ(verdicts(160 * kUs, 1350), Verdict::pass);
  EXPECT_EQ(verdicts(160 * kUs, 1349), Verdict::inconclusive);
  // No more than a timer that was reset unnoticed.
  EXPECT_EQ(verdicts(4 * kMs, 1200 + 990), Verdict::pass);
  EXPECT_EQ(verdicts(160 * kUs, 999), Verdict::fail);
}

TEST(Ros2Timers, PeriodsThatAnInstanceOverrunsAreSkipped) {
  // The first call leaves expiry 2 as the next, the second call, at 38 ms, expiry 4.
  const auto result = Text()
                          .run(expiry(1) + 100 * kUs, 23 * kMs)
                          .run_next(expiry(1) + 23'120 * kUs)
                          .run(expiry(4) + 100 * kUs)
                          .analyze();
  EXPECT_EQ(releases(result), (std::vector{expiry(1), expiry(2), expiry(4)}));
  EXPECT_EQ(result.callback(kId).missed_releases, 1U);
  EXPECT_EQ(result.verdict("R2"), Verdict::fail);
  EXPECT_THAT(result.evidence("R2"), HasSubstr("seq 2: 1 period was skipped before this release"));
  EXPECT_EQ(result.verdict("R1"), Verdict::fail);
}

// One period is skipped.
Text& overrun(Text& text) {
  return text.run(expiry(1) + 100 * kUs, 23 * kMs)
      .run_next(expiry(1) + 23'120 * kUs)
      .run(expiry(4) + 100 * kUs);
}

std::string allows(const std::string& id, int periods) {
  return "  - {id: \"" + id + "\", missed_releases_allowed: " + std::to_string(periods) + "}\n";
}

// It may be the second of its id, which the spec allows more.
TEST(Ros2Timers, WhatMayBeAllowedFailsNothing) {
  Text text;
  overrun(text.add_other_timer(kPeriod));
  const auto verdict = [&](std::int64_t lost_at, int first, int second) {
    return text
        .analyze(lost_at, "callback_groups:\n" + allows(kId, first) +
                              allows(std::string(kId) + "#2", second) + allows("/m/*", 9))
        .verdict("R2");
  };
  EXPECT_EQ(verdict(-1, 1, 0), Verdict::pass);
  EXPECT_EQ(verdict(-1, 0, 1), Verdict::fail);
  EXPECT_EQ(verdict(1, 1, 0), Verdict::inconclusive);
  EXPECT_EQ(verdict(1, 0, 1), Verdict::inconclusive);
  EXPECT_EQ(verdict(1, 0, 0), Verdict::fail) << "none that may be its own allows it";
}

// Its node was made before the recording: the entry of any node may be its own.
TEST(Ros2Timers, ATimerOfAnyNodeMayBeAllowedIt) {
  Text text(true, "0x11");
  overrun(text);
  const auto verdict = [&](const std::string& id) {
    return text.analyze(-1, "callback_groups:\n" + allows(id, 1)).verdict("R2");
  };
  EXPECT_EQ(text.analyze().logical_ids(), (std::vector<std::string>{"?@Timer(10000000)"}));
  EXPECT_EQ(verdict("/m@Timer(10000000)"), Verdict::inconclusive);
  EXPECT_EQ(verdict("/m/*"), Verdict::inconclusive);
  EXPECT_EQ(verdict("/m@Timer(20000000)"), Verdict::fail);
  EXPECT_EQ(verdict("/m@Subscription(/t)"), Verdict::fail);
}

TEST(Ros2Timers, WhatAnExecutorSkipsBeforeItRunsIsNotMissed) {
  const auto result = Text()
                          .run(expiry(50) + 3 * kMs)
                          .run(expiry(51) + 100 * kUs)
                          .run(expiry(52) + 100 * kUs)
                          .analyze();
  EXPECT_EQ(releases(result), (std::vector<std::int64_t>{-1, expiry(51), expiry(52)}));
  EXPECT_EQ(result.callback(kId).release_source, ReleaseSource::mixed);
  EXPECT_EQ(result.callback(kId).missed_releases, 0U);
  EXPECT_EQ(result.verdict("R2"), Verdict::pass);
}

// Whether the executor had the timer's node by then nobody tells.
TEST(Ros2Timers, WhatIsSkippedWhileOtherCallbacksRunMayBeMissed) {
  const auto result = [](std::int64_t since) {
    Text text;
    text.add_other_timer();
    text.add(since, "callback_start callback=0x31");
    text.add(expiry(3) + 80 * kUs, "callback_end callback=0x31");
    text.run_next(expiry(3) + 100 * kUs);
    for (std::int64_t k = 4; k <= 6; ++k)
      text.run(expiry(k) + 100 * kUs);
    return text.analyze();
  };
  const auto busy = result(expiry(1) - kMs);
  EXPECT_EQ(busy.callback(kId).missed_releases, std::nullopt);
  EXPECT_EQ(busy.verdict("R2"), Verdict::inconclusive);
  const auto slow = result(expiry(3) + 10 * kUs);
  EXPECT_EQ(slow.callback(kId).missed_releases, 0U);
}

TEST(Ros2Timers, AnExpiryWhileTheTimerMayHaveBeenCalledLeavesTheNextReleaseOpen) {
  // Called before or after expiry 3: the next release is that or the one after it.
  const auto result = Text()
                          .run(expiry(1) + 100 * kUs)
                          .run(expiry(2) + 100 * kUs, 9'850 * kUs)
                          .run_next(expiry(3) + 40 * kUs, 10 * kMs)
                          .run_next(expiry(4) + 60 * kUs)
                          .run(expiry(5) + 100 * kUs)
                          .analyze();
  EXPECT_EQ(releases(result), (std::vector{expiry(1), expiry(2), expiry(3), expiry(4), expiry(5)}));
  const auto open = Text()
                        .run(expiry(1) + 100 * kUs, 19'850 * kUs)
                        .run_next(expiry(3) + 40 * kUs, 10 * kMs)
                        .run_next(expiry(4) + 60 * kUs)
                        .run(expiry(5) + 100 * kUs)
                        .analyze();
  EXPECT_EQ(releases(open), (std::vector<std::int64_t>{expiry(1), expiry(2), -1, expiry(5)}));
  // Expiry 3 or 4 was skipped.
  EXPECT_EQ(open.callback(kId).missed_releases, 1U);
}

TEST(Ros2Timers, AnExecutorThatCallsTimersAheadSkipsNothing) {
  // One that does not look for work in the order it does it, and catches up.
  Text text(false);
  text.run(expiry(1) + 100 * kUs, 35 * kMs);
  for (int i = 0; i < 3; ++i)
    text.run(expiry(4) + 5'120 * kUs + i * kMs, 980 * kUs);
  text.run(expiry(6) + 100 * kUs).run(expiry(7) + 100 * kUs);
  const auto result = text.analyze();
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
  // No start tells by itself that it was on time: the second one's release stays unproven.
  EXPECT_EQ(releases(result), (std::vector<std::int64_t>{expiry(1), -1, -1, -1, -1, -1}));
}

TEST(Ros2Timers, AStartBeforeItsReleaseRefutesTheGrid) {
  // The clock of the timer is faster than that of the trace, or its period was exchanged.
  Text text;
  for (std::int64_t k = 1; k <= 8; ++k)
    text.run(expiry(k) + (400 - 60 * k) * kUs);
  const auto result = text.analyze();
  const auto& timer = result.callback(kId);
  EXPECT_EQ(timer.release_source, ReleaseSource::start);
  EXPECT_FALSE(timer.response_time);
  EXPECT_FALSE(timer.start_latency);
  EXPECT_FALSE(timer.inter_arrival);
  EXPECT_FALSE(timer.missed_releases);
  EXPECT_EQ(timer.response_time_lower->count, 8U);
  EXPECT_EQ(timer.response_time_lower->sum, 8 * kMs);
  EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
}

TEST(Ros2Timers, ADriftRefutesTheGrid) {
  // Each instance resets the timer, or its clock is slower than that of the trace.
  Text text;
  std::int64_t start = expiry(1);
  for (int i = 0; i < 60; ++i, start += kPeriod + 300 * kUs)
    text.run(start + 100 * kUs);
  const auto result = text.analyze();
  EXPECT_EQ(result.callback(kId).release_source, ReleaseSource::start);
  EXPECT_EQ(result.callback(kId).response_time_lower->count, 60U);
  EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
}

TEST(Ros2Timers, AResetLeavesBounds) {
  // The grid moves by 4 ms after a pause of 20 periods.
  Text text;
  for (std::int64_t k = 1; k <= 40; ++k)
    text.run(expiry(k) + 100 * kUs);
  for (std::int64_t k = 60; k <= 66; ++k)
    text.run(expiry(k) + 4'100 * kUs);
  const auto result = text.analyze();
  const auto times = releases(result);
  EXPECT_EQ(times[39], expiry(40));
  for (std::size_t i = 40; i < times.size(); ++i)
    EXPECT_EQ(times[i], -1);
  const auto& timer = result.callback(kId);
  EXPECT_EQ(timer.response_time->max, 1'100 * kUs);
  EXPECT_EQ(timer.response_time_lower->count, 7U);
  EXPECT_FALSE(timer.missed_releases);
  EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
}

TEST(Ros2Timers, AWatchdogThatIsResetAllTheTimeSkipsNothing) {
  Text text;
  for (std::int64_t k = 1; k <= 12; ++k)
    text.run(expiry(17 * k) + (k * 7 % 10) * kMs + 500 * kUs);
  const auto result = text.analyze();
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive);
}

// A cancelled timer that is reset later, while something else runs every millisecond: the executor looked for work often
// enough in between to have called it.
TEST(Ros2Timers, WhatWasDueWhenTheExecutorWaitedWouldHaveRun) {
  Text text;
  for (std::int64_t k = 1; k <= 20; ++k)
    text.run(expiry(k) + 100 * kUs, 50 * kUs);
  for (auto time = expiry(20) + kMs; time < expiry(44); time += kMs - 50 * kUs) {
    text.wait(time).add(time, "callback_start callback=0x70");
    text.add(time + 20 * kUs, "callback_end callback=0x70");
  }
  for (std::int64_t k = 44; k <= 60; ++k)
    text.run(expiry(k) + 410 * kUs, 50 * kUs);
  const auto result = text.analyze(
      -1, "callback_groups:\n  - id: " + std::string(kId) + "\n    response_deadline: 2ms\n");
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive) << result.evidence("R2");
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive) << result.evidence("R3");
}

// Each start of a timer of 1 ms is within 1 ms after some expiry: that says nothing of its grid.
TEST(Ros2Timers, AShortPeriodConfirmsNoGridByItself) {
  std::string text = R"(
    0 rcl_node_init node_handle=0x10 node_name=n namespace=/
    1000 rcl_timer_init timer_handle=0x20 period=1000000
    1000 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    1000 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
)";
  for (std::int64_t i = 0; i < 60; ++i) {  // its callback resets it: 70 us more than the period
    const auto start = 1'031'000 + i * 1'070'000;
    text += std::to_string(start - 2) + " rclcpp_executor_wait_for_work timeout=1\n" +
            std::to_string(start - 1) + " rclcpp_executor_get_next_ready\n" +
            std::to_string(start) + " callback_start callback=0x30\n" +
            std::to_string(start + 20'000) + " callback_end callback=0x30\n";
  }
  const auto result = analyze_ros2(
      text, -1, "callback_groups:\n  - id: /n@Timer(1000000)\n    response_deadline: 500us\n");
  for (const auto* rule : {"R1", "R2", "R3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule << result.evidence(rule);
}

// The releases may be 100 us off: had a reset moved them by more, not all starts came as near.
TEST(Ros2Timers, ADeadlineIsJudgedByTheErrorOfReleases) {
  const auto verdict_of = [](std::int64_t us) {
    Text text;
    text.run(expiry(1) + 100 * kUs).run(expiry(2) + 300 * kUs).run(expiry(3) + 100 * kUs);
    return text.analyze(-1, deadline_us(us)).verdict("R3");  // of 1300 us
  };
  EXPECT_EQ(verdict_of(1'400), Verdict::pass);
  EXPECT_EQ(verdict_of(1'399), Verdict::inconclusive);
  EXPECT_EQ(verdict_of(1'200), Verdict::inconclusive);
  EXPECT_EQ(verdict_of(1'199), Verdict::fail);
}

// A timer, which publishes at once, and who takes that: 2 ms from start to end.
class Pair {
 public:
  Pair() {
    text_.add(kMade, "rcl_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/t")
        .add(kMade, "rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/")
        .add(kMade,
             "rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 topic_name=/t "
             "queue_depth=1")
        .add(kMade, "rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40")
        .add(kMade, "rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50");
  }
  Pair& run(std::int64_t start) {
    const auto stamp = std::to_string(start + 2);
    text_.wait(start)
        .add(start, "callback_start callback=0x30")
        .add(start + 1, "rcl_publish publisher_handle=0x60 message=0x99")
        .add(start + 2, "rmw_publish message=0x99 timestamp=" + stamp)
        .add(start + kMs, "callback_end callback=0x30")
        .add(start + kMs + 1, "rmw_take pid=2 tid=2 message=0x88 taken=1 source_timestamp=" + stamp)
        .add(start + kMs + 2, "callback_start pid=2 tid=2 callback=0x50")
        .add(start + 2 * kMs, "callback_end pid=2 tid=2 callback=0x50");
    return *this;
  }
  Verdict within_us(std::int64_t us) const {
    return text_
        .analyze(-1,
                 "chains:\n  - {name: c, callbacks: [\"/n@Timer(10000000)\", "
                 "\"/b@Subscription(/t)\"], path_latency: " +
                     std::to_string(us * kUs) + "}\n")
        .verdict("Q2");
  }

 private:
  Text text_;
};

// As the response time above: up to 100 us off, and 300 us after an expiry the chain begins.
TEST(Ros2Timers, AChainsBoundIsJudgedByTheErrorOfReleases) {
  const auto pair =
      Pair().run(expiry(1) + 100 * kUs).run(expiry(2) + 300 * kUs).run(expiry(3) + 100 * kUs);
  EXPECT_EQ(pair.within_us(2'400), Verdict::pass);
  EXPECT_EQ(pair.within_us(2'399), Verdict::inconclusive);
  EXPECT_EQ(pair.within_us(2'000), Verdict::inconclusive);
  EXPECT_EQ(pair.within_us(1'999), Verdict::fail);
}

TEST(Ros2Timers, NoChainPassesByReleasesThatAreNotCertain) {
  Pair pair;
  for (std::int64_t k = 1; k <= 9; ++k)
    pair.run(expiry(k) + 100 * kUs);
  for (std::int64_t k = 30; k <= 50; ++k)
    pair.run(expiry(k) + 600 * kUs);
  EXPECT_EQ(pair.within_us(100'000), Verdict::inconclusive) << "a reset is possible";
}

// Of two releases and a response time.
TEST(Ros2Timers, ArrivalsAreJudgedByTheErrorOfReleases) {
  const auto verdict_of = [](std::int64_t response) {
    Text text;
    text.run(expiry(1) + 100 * kUs, response - 100 * kUs);
    text.run_next(expiry(2) + 400 * kUs).run(expiry(3) + 100 * kUs);
    return text.analyze().verdict("R1");
  };
  EXPECT_EQ(verdict_of(kPeriod - 300 * kUs - 1), Verdict::pass);
  EXPECT_EQ(verdict_of(kPeriod - 300 * kUs), Verdict::inconclusive);
  EXPECT_EQ(verdict_of(kPeriod + 300 * kUs - 1), Verdict::inconclusive);
  EXPECT_EQ(verdict_of(kPeriod + 300 * kUs), Verdict::fail);
}

TEST(Ros2Timers, RatesAreJudgedByTheErrorOfReleases) {
  const auto verdict_of = [](const char* bound, std::int64_t us) {
    Text text;
    for (std::int64_t k = 1; k <= 3; ++k)
      text.run(expiry(k) + 100 * kUs);
    const auto spec = std::string("callback_groups:\n  - {id: \"/n@Timer(10000000)\", ") + bound +
                      ": " + std::to_string(us * kUs) + "}\n";
    return text.analyze(-1, spec).verdict("R5");
  };
  EXPECT_EQ(verdict_of("min_inter_arrival", 9'800), Verdict::pass);
  EXPECT_EQ(verdict_of("min_inter_arrival", 10'000), Verdict::inconclusive);
  EXPECT_EQ(verdict_of("min_inter_arrival", 10'201), Verdict::fail);
  EXPECT_EQ(verdict_of("max_inter_arrival", 10'200), Verdict::pass);
  EXPECT_EQ(verdict_of("max_inter_arrival", 10'000), Verdict::inconclusive);
  EXPECT_EQ(verdict_of("max_inter_arrival", 9'799), Verdict::fail);
}

TEST(Ros2Timers, AResetThatNearlyKeepsTheGridAccusesNobody) {
  // Cancelled for 20 periods, and the grid moves by half a millisecond: starts seem prompt.
  const auto text = [] {
    Text all;
    for (std::int64_t k = 1; k <= 9; ++k)
      all.run(expiry(k) + 100 * kUs);
    for (std::int64_t k = 30; k <= 50; ++k)
      all.run(expiry(k) + 600 * kUs);
    return all;
  }();
  // The longest response time was 1100 us, and seems to be 1600 us.
  const auto result = text.analyze(-1, deadline_us(1'300));
  EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive);
  EXPECT_EQ(result.callback(kId).late, 0U);
}

// `after`: behind the expiries, of the 20 starts that come after 20 others, which lie 100 or 100 + `scatter` behind.
Text shifted(std::int64_t scatter_us, std::int64_t after_us) {
  Text text;
  for (std::int64_t k = 1; k <= 20; ++k)
    text.run(expiry(k) + (100 + k % 2 * scatter_us) * kUs);
  for (std::int64_t k = 50; k < 70; ++k)
    text.run(expiry(k) + after_us * kUs);
  return text;
}

// Cancelled for 30 periods and reset where the grid is nearly the same: no start comes as near any more.
TEST(Ros2Timers, AGridThatAllStartsHaveLeftIsRefuted) {
  for (const std::int64_t after : {111, 600, 950}) {
    const auto result = shifted(0, after).analyze();
    const auto& timer = result.callback(kId);
    EXPECT_EQ(timer.release_source, ReleaseSource::start) << after;
    EXPECT_FALSE(timer.response_time) << after;
    EXPECT_FALSE(timer.start_latency) << after;
    EXPECT_EQ(timer.response_time_lower->count, 40U) << after;
    EXPECT_EQ(result.verdict("R1"), Verdict::inconclusive) << after;
    EXPECT_EQ(result.verdict("R2"), Verdict::inconclusive) << after;
  }
}

// One start that comes as near shows that it was not the grid that moved.
TEST(Ros2Timers, ALoadThatPassesRefutesNoGrid) {
  auto text = shifted(0, 600);
  for (std::int64_t k = 70; k < 80; ++k)
    text.run(expiry(k) + 100 * kUs);
  const auto result = text.analyze();
  EXPECT_EQ(result.callback(kId).response_time->count, 49U);  // all but the first after the pause
  EXPECT_EQ(result.callback(kId).response_time->max, 1'600 * kUs);
}

// A few starts that lag behind, or starts that scatter as much anyway, show nothing.
TEST(Ros2Timers, StartsThatScatterRefuteNoGrid) {
  EXPECT_EQ(shifted(0, 110).analyze().callback(kId).response_time->count, 39U);
  EXPECT_EQ(shifted(300, 700).analyze().callback(kId).response_time->count, 39U);
  EXPECT_FALSE(shifted(300, 701).analyze().callback(kId).response_time);
  Text text;
  for (std::int64_t k = 1; k <= 20; ++k)
    text.run(expiry(k) + 100 * kUs);
  for (std::int64_t k = 21; k <= 35; ++k)
    text.run(expiry(k) + 600 * kUs);
  EXPECT_EQ(text.analyze().callback(kId).response_time->count, 35U);
  text.run(expiry(36) + 600 * kUs);
  EXPECT_FALSE(text.analyze().callback(kId).response_time);
}

TEST(Ros2Timers, WhatRunsBeforeATimersCallbackRefutesNoGrid) {
  Text text;
  for (std::int64_t k = 1; k <= 20; ++k)
    text.run(expiry(k) + 100 * kUs);
  for (std::int64_t k = 21; k <= 40; ++k) {
    text.wait(expiry(k) + 90 * kUs).add(expiry(k) + 100 * kUs, "callback_start callback=0x70");
    text.add(expiry(k) + 590 * kUs, "callback_end callback=0x70").run_next(expiry(k) + 600 * kUs);
  }
  EXPECT_EQ(text.analyze().callback(kId).response_time->count, 40U);
}

// What the releases are good to is what all of some starts lie behind them, had a reset moved them unnoticed.
TEST(Ros2Timers, TheReportTellsHowGoodReleasesAre) {
  const auto result = shifted(300, 700).analyze();
  EXPECT_EQ(result.callback(kId).release_error, analysis::Duration{700 * kUs});
  Text text;
  EXPECT_EQ(text.run(expiry(1) + 4 * kUs).analyze().callback(kId).release_error,
            analysis::Duration{10 * kUs});
}

TEST(Ros2Timers, WhatMayHaveBeenAResetAccusesNobody) {
  // The fourth instance takes 23 ms, the fifth seems to have waited 13 ms for its end.
  const auto verdict_of = [](std::int64_t moved) {
    Text text;
    for (std::int64_t k = 1; k <= 3; ++k)
      text.run(expiry(k) + 100 * kUs);
    text.run(expiry(4) + 100 * kUs, 23 * kMs);
    text.run_next(expiry(6) + 3'120 * kUs, 13 * kMs);
    for (std::int64_t k = 9; k <= 11; ++k)
      text.run(expiry(k) + moved + 100 * kUs);
    return text.analyze(-1, deadline_us(25'000)).verdict("R3");
  };
  EXPECT_EQ(verdict_of(0), Verdict::fail);
  EXPECT_EQ(verdict_of(4 * kMs), Verdict::inconclusive);
}

TEST(Ros2Timers, WhatIsToldASecondTimeSaysNotWhenATimerWasMade) {
  // A tracer of CARET says when it begins to record what was made before.
  const auto result = analyze_ros2(R"(
    0 rcl_node_init node_handle=0x10 node_name=n namespace=/
    1 ros2_caret:rcl_timer_init timer_handle=0x20 period=10000000
    1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
    10000100 callback_start callback=0x30
    10000200 callback_end callback=0x30)");
  EXPECT_EQ(result.analysis.report.callbacks.at(0).release_source, ReleaseSource::start);
}

}  // namespace
}  // namespace cie::test::timers
