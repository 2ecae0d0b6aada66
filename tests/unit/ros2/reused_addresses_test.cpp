// A callback of ROS 2's is known by an address, which is given anew when it is destroyed: what told of
// that may be lost.
#include "ros2_text.hpp"
#include "timer_text.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::HasSubstr;
using testing::Not;

constexpr auto kPerhaps = "may be another callback's";
constexpr const char* kAddressDeadlines =
    "callback_groups:\n  - {id: \"/n@Timer(1)\", response_deadline: 50}\n"
    "  - {id: \"/n@Subscription(/t)\", response_deadline: 50}\n";

std::string run_of(int time, int duration, int tid = 1, const char* callback = "0x30") {
  const auto at = [&](int when, const char* event) {
    return "  " + std::to_string(when) + ' ' + event + " tid=" + std::to_string(tid) +
           " callback=" + callback + '\n';
  };
  return at(time, "callback_start") + at(time + duration, "callback_end");
}

// A timer of period 1 is destroyed, and a subscription is made where its callback lay.
const std::vector<std::string> kMadeThere{
    "  510 rcl_subscription_init subscription_handle=0x40 node_handle=0x10 topic_name=/t queue_depth=1\n",
    "  511 rclcpp_subscription_init subscription_handle=0x40 subscription=0x41\n",
    "  512 rclcpp_subscription_callback_added subscription=0x41 callback=0x30\n",
    "  513 rclcpp_callback_register callback=0x30 symbol=take\n"};
constexpr const char* kLossBetween = "  505 lost until=520\n";

std::string made_where_it_lay() {
  std::string text;
  for (const auto& line : kMadeThere)
    text += line;
  return text;
}

Ros2Result with_deadlines(const std::string& events) {
  return analyze_ros2(kTwoTimers + events, -1, kAddressDeadlines);
}

Verdict verdict_on(const Ros2Result& result, std::string_view rule, std::string_view subject) {
  for (const auto& of_rule : result.analysis.verdicts.rules) {
    if (of_rule.id != rule) continue;
    for (const auto& verdict : of_rule.subjects)
      if (verdict.subject.find(subject) != std::string::npos) return verdict.verdict;
  }
  ADD_FAILURE() << rule << " judged no " << subject;
  return Verdict::not_applicable;
}

TEST(Ros2ReusedAddresses, NoDeadlineIsMissedByRunsThatMayBeOfAnotherCallback) {
  const auto before = run_of(100, 10);
  const auto later = run_of(600, 200);  // the subscription's
  EXPECT_EQ(verdict_on(with_deadlines(before + made_where_it_lay() + later), "R3", "Timer(1)"),
            Verdict::inconclusive)
      << "its releases are not known";
  const auto lost = with_deadlines(before + kLossBetween + later);
  EXPECT_EQ(verdict_on(lost, "R3", "Timer(1)"), Verdict::inconclusive);
  EXPECT_THAT(lost.evidence("R3"), HasSubstr(kPerhaps));
  EXPECT_THAT(lost.evidence("R3"), HasSubstr("at least 200 ns"));
  EXPECT_EQ(lost.durations(), "/n@Timer(1): 2 of 10 to 200\n") << "the number stands";
}

TEST(Ros2ReusedAddresses, OneThatIsMissedBeforeTheLossIsMissed) {
  const auto result = with_deadlines(run_of(100, 60) + kLossBetween + run_of(600, 200));
  EXPECT_EQ(verdict_on(result, "R3", "Timer(1)"), Verdict::fail);
  EXPECT_THAT(result.evidence("R3"), HasSubstr("at least 60 ns"));
}

TEST(Ros2ReusedAddresses, OneThatIsMissedByWhatWasMadeAfterTheLossIsMissed) {
  const auto result = with_deadlines(run_of(100, 10) + "  490 lost until=505\n" +
                                     made_where_it_lay() + run_of(600, 200));
  EXPECT_EQ(verdict_on(result, "R3", "Subscription(/t)"), Verdict::fail);
  EXPECT_EQ(verdict_on(result, "R3", "Timer(1)"), Verdict::inconclusive);
}

TEST(Ros2ReusedAddresses, WhatIsMadeWhileEventsAreLostMayHaveBeenReplacedSince) {
  const auto result =
      with_deadlines("  490 lost until=700\n" + made_where_it_lay() + run_of(600, 200));
  EXPECT_EQ(verdict_on(result, "R3", "Subscription(/t)"), Verdict::inconclusive);
}

// What is told of a handle or of an address alone leaves the other one as it was.
TEST(Ros2ReusedAddresses, HalfOfARegistrationProvesNothing) {
  const std::string of_the_old_handle =
      "  530 rclcpp_timer_callback_added timer_handle=0x20 callback=0x99\n";
  const auto result = with_deadlines(run_of(100, 10) + kLossBetween + of_the_old_handle +
                                     run_of(600, 200, 1, "0x99"));
  EXPECT_EQ(verdict_on(result, "R3", "Timer(1)"), Verdict::inconclusive);
}

// Timer 2 ran on thread 2 and its address on thread 1 later. Before a gap, it runs there at once.
TEST(Ros2ReusedAddresses, NoThreadIsSharedByRunsThatMayBeOfAnotherCallback) {
  const auto before = run_of(100, 10, 1) + run_of(120, 10, 2, "0x31") + run_of(140, 10, 1);
  const auto later = run_of(600, 10, 1, "0x31") + run_of(620, 10, 2, "0x31") + run_of(640, 10, 1);
  for (const auto* loss : {kLossBetween, "  505 session until=520\n"}) {
    const auto result = with_deadlines(before + loss + later);
    for (const auto* rule : {"M2", "M3"}) {
      EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule << loss;
      EXPECT_THAT(result.evidence(rule), HasSubstr(kPerhaps)) << rule << loss;
    }
    EXPECT_NE(result.verdict("M4"), Verdict::fail) << loss;
    EXPECT_FALSE(result.callback("/n@Timer(1)").isolation) << loss;
  }
  const auto shared = with_deadlines(before + run_of(160, 10, 1, "0x31") +
                                     run_of(180, 10, 2, "0x31") + kLossBetween);
  EXPECT_EQ(verdict_on(shared, "M2", "thread 1"), Verdict::fail);
  EXPECT_EQ(verdict_on(shared, "M3", "Timer(2)"), Verdict::fail);
  EXPECT_THAT(shared.evidence("M2"), Not(HasSubstr(kPerhaps)));
}

// Thread 1 ran the timer, exits, and its address runs on thread 3.
TEST(Ros2ReusedAddresses, NothingMovesByRunsThatMayBeOfAnotherCallback) {
  const auto moves = [](int loss) {
    return with_deadlines(run_of(100, 10, 1) + (loss < 200 ? "  150 lost until=160\n" : "") +
                          run_of(300, 10, 1) + "  400 sched:sched_process_exit tid=1\n" +
                          run_of(600, 10, 3));
  };
  EXPECT_EQ(verdict_on(moves(1000), "M4", "Timer(1)"), Verdict::fail);
  EXPECT_EQ(verdict_on(moves(150), "M4", "Timer(1)"), Verdict::inconclusive);
}

// An end whose start is not seen tells of a run of whatever lies there.
TEST(Ros2ReusedAddresses, AnEndAloneIsOfWhateverLiesThere) {
  const auto result =
      with_deadlines(run_of(100, 10, 1) + kLossBetween +
                     "  600 callback_end tid=3 callback=0x30\n" + run_of(700, 10, 1));
  EXPECT_EQ(result.verdict("M3"), Verdict::inconclusive) << result.evidence("M3");
}

// By the kernel's switches of threads that ran a callback.
TEST(Ros2ReusedAddresses, NoParametersAreAskedOfThreadsThatMayBeAnothers) {
  const std::string spec =
      "callback_groups:\n  - {id: /n@Timer(1), policy: SCHED_FIFO, priority: 20}\n";
  const auto result_of = [&spec](const std::string& loss) {
    return analyze_ros2(kTwoTimers + instance(100, 120) + "\n" + loss + instance(600, 120), -1,
                        spec);
  };
  EXPECT_EQ(result_of("").verdict("S1"), Verdict::fail);
  EXPECT_EQ(result_of(kLossBetween).verdict("S1"), Verdict::fail) << "it is its thread before";
  const auto lost =
      analyze_ros2(kTwoTimers + std::string(kLossBetween) + instance(600, 120), -1, spec);
  EXPECT_EQ(lost.verdict("S1"), Verdict::inconclusive);
  EXPECT_THAT(lost.evidence("S1"), HasSubstr(kPerhaps));
  EXPECT_EQ(lost.verdict("S2"), Verdict::inconclusive);
  EXPECT_EQ(lost.verdict("S3"), Verdict::pass) << "whoever it is, its priority stays";
}

// A queue of a subscription, whose buffer may be another one's.
TEST(Ros2ReusedAddresses, NoSampleIsOverwrittenInAQueueThatMayBeAnothers) {
  const std::string made = R"(
    0 rcl_node_init node_handle=0x10 node_name=n namespace=/
    2 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 topic_name=/t queue_depth=1
    3 rclcpp_subscription_callback_added subscription=0x41 callback=0x51
    4 rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
    5 rclcpp_buffer_to_ipb buffer=0x80 ipb=0x41
)";
  const auto overwrite = [](int time) {
    return "  " + std::to_string(time) +
           " rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=1\n";
  };
  EXPECT_EQ(analyze_ros2(made + overwrite(100)).verdict("Q1"), Verdict::fail);
  const auto later = analyze_ros2(made + kLossBetween + overwrite(600));
  EXPECT_EQ(later.verdict("Q1"), Verdict::inconclusive);
  EXPECT_THAT(later.evidence("Q1"), HasSubstr(kPerhaps));
  EXPECT_EQ(analyze_ros2(made + overwrite(100) + kLossBetween + overwrite(600)).verdict("Q1"),
            Verdict::fail);
}

// The third run of a timer of 10 ms overruns two expiries: the fourth one runs late and skips one.
TEST(Ros2ReusedAddresses, NoPeriodIsSkippedByRunsThatMayBeOfAnotherCallback) {
  using timers::expiry;
  using timers::kUs;
  const auto recorded = [](int lost_before) {
    timers::Text text;
    const auto lose = [&text, lost_before](int k) {
      const auto time = expiry(k) - 5 * timers::kMs;
      if (k == lost_before) text.add(time, "lost until=" + std::to_string(time + timers::kMs));
    };
    for (const int k : {1, 2})
      text.run(expiry(k) + 100 * kUs);
    lose(3);
    text.run(expiry(3) + 100 * kUs, 23 * timers::kMs).run_next(expiry(3) + 23'120 * kUs);
    text.run(expiry(6) + 100 * kUs);
    lose(7);
    for (const int k : {7, 8})
      text.run(expiry(k) + 100 * kUs);
    return text.analyze();
  };
  EXPECT_EQ(recorded(-1).verdict("R2"), Verdict::fail);
  EXPECT_EQ(recorded(7).verdict("R2"), Verdict::fail) << "it was skipped before";
  const auto lost = recorded(3);
  EXPECT_EQ(lost.verdict("R2"), Verdict::inconclusive);
  EXPECT_THAT(lost.evidence("R2"), HasSubstr(kPerhaps));
}

// CARET says again, when a session begins, what addresses are.
TEST(Ros2ReusedAddresses, WhatIsToldAgainAfterALossIsCertainAgain) {
  const std::string again = R"(
  530 ros2_caret:rcl_node_init node_handle=0x10 node_name=n namespace=/
  531 ros2_caret:rcl_timer_init timer_handle=0x20 period=1
  532 ros2_caret:rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  533 ros2_caret:rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
)";
  const auto between = "  525 callback_start callback=0x30\n  526 callback_end callback=0x30\n";
  const auto result =
      with_deadlines(run_of(100, 10) + kLossBetween + between + again + run_of(600, 200));
  EXPECT_EQ(verdict_on(result, "R3", "Timer(1)"), Verdict::fail);
}

// Law L2: whatever is lost of the registration, nothing fails that did not.
TEST(Ros2ReusedAddresses, WhateverIsLostOfARegistrationNothingFailsByIt) {
  const auto before = run_of(100, 10, 1) + run_of(120, 10, 2, "0x31");
  const auto later = run_of(600, 200, 3) + run_of(900, 200, 3);
  const auto whole = with_deadlines(before + made_where_it_lay() + later);
  for (unsigned lost = 1; lost < 1U << kMadeThere.size(); ++lost) {
    std::string rest;
    for (std::size_t i = 0; i < kMadeThere.size(); ++i)
      if ((lost >> i & 1U) == 0) rest += kMadeThere[i];
    const auto result = with_deadlines(before + kLossBetween + rest + later);
    for (const auto& rule : result.analysis.verdicts.rules) {
      for (const auto& verdict : rule.subjects) {
        if (verdict.verdict != Verdict::fail) continue;
        EXPECT_EQ(verdict_on(whole, rule.id, verdict.subject), Verdict::fail)
            << rule.id << ' ' << verdict.subject << " without " << lost;
      }
    }
  }
}

}  // namespace
}  // namespace cie::test
