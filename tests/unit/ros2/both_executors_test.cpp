// What another executor runs in a process of rclcpp that tells in this project's events, too.
#include "both_providers.hpp"
#include "ros2_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// A listener as tf2 has it: an executor of rclcpp's serves its two subscriptions on a thread of its own.
constexpr const char* kListener = R"(
    3 rcl_node_init node_handle=0x18 node_name=tf namespace=/
    3 rcl_subscription_init subscription_handle=0x28 node_handle=0x18 topic_name=/tf queue_depth=100
    3 rclcpp_subscription_init subscription_handle=0x28 subscription=0x48
    3 rclcpp_subscription_callback_added subscription=0x48 callback=0x38
    3 rcl_subscription_init subscription_handle=0x29 node_handle=0x18 topic_name=/tf_static queue_depth=100
    3 rclcpp_subscription_init subscription_handle=0x29 subscription=0x49
    3 rclcpp_subscription_callback_added subscription=0x49 callback=0x39)";
constexpr const char* kListened = R"(
    26 callback_start tid=9 callback=0x38
    27 callback_end tid=9 callback=0x38
    27 callback_start tid=9 callback=0x39
    29 callback_end tid=9 callback=0x39)";
// What this project's own threads are announced as.
constexpr const char* kThreads = R"(
  3 cie:thread_init tid=2 role=callback callback_id=0 group_id=0 name=n:7 start_ns=1
  3 cie:thread_init tid=3 role=callback callback_id=1 group_id=1 name=n:t start_ns=1)";
constexpr const char* kEndedThreads = R"(
  30 cie:callback_fini callback_id=0 started=1 ended=1 released=0 overwritten=0 lost=0
  30 cie:callback_fini callback_id=1 started=1 ended=1 released=0 overwritten=0 lost=0
  30 cie:thread_fini tid=2 read_backs=0
  30 cie:thread_fini tid=3 read_backs=0
  31 cie:run_end callbacks=2 threads=2 groups=2 publishers=0 status=0)";

TEST(BothProviders, WhatAnotherExecutorRunsIsJudgedLikeAnythingElse) {
  const auto result = analyze_ros2(std::string(kDescribed) + kThreads + kListener + kRan +
                                   kListened + kEndedThreads);
  EXPECT_THAT(result.logical_ids(),
              ElementsAre("/n@Timer(7)", "/n@Subscription(/t)", "/tf@Subscription(/tf)",
                          "/tf@Subscription(/tf_static)"));
  EXPECT_THAT(result.durations(), HasSubstr("/tf@Subscription(/tf): 1 of 1 to 1\n"
                                            "/tf@Subscription(/tf_static): 1 of 2 to 2\n"));
  EXPECT_EQ(result.verdict("M2"), Verdict::fail);
  EXPECT_THAT(result.evidence("M2"), AllOf(HasSubstr("/tf@Subscription(/tf) started here"),
                                           HasSubstr("/tf@Subscription(/tf_static) started here")));
  EXPECT_EQ(result.verdict("M9"), Verdict::fail) << "no thread was announced for them";
  for (const auto* rule : {"M7", "M8", "T4", "E1"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule << '\n' << result.evidence(rule);
  EXPECT_EQ(result.verdict("M4"), Verdict::inconclusive) << "whose is the client of /enable?";
  EXPECT_EQ(result.callback("/tf@Subscription(/tf)").isolation, analysis::Isolation::not_isolated);
  EXPECT_EQ(result.callback("/n@Timer(7)").isolation, analysis::Isolation::isolated);
}

TEST(BothProviders, WhatAClientOfItsOwnRanNoOtherExecutorDid) {
  const std::string client = R"(
    3 cie:callback_init callback_id=2 node_id=0 group_id=1 kind=client logical_id=/n@Client(/enable) source=/enable next_seq=0)";
  std::string ended = kEndedThreads;
  ended.replace(ended.find("callbacks=2"), 11, "callbacks=3");
  ended.insert(
      0,
      "\n  30 cie:callback_fini callback_id=2 started=0 ended=0 released=0 overwritten=0 lost=0");
  const auto result = analyze_ros2(std::string(kDescribed) + client + kThreads + kListener + kRan +
                                   kListened + ended);
  for (const auto* rule : {"M3", "M4", "T4"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule << '\n' << result.evidence(rule);
}

// What would tell that a callback is this project's own may be among what is lost.
TEST(BothProviders, WhatAnotherExecutorRunsIsUndecidedWhereAnythingOfItsOwnIsMissing) {
  const std::string all = std::string(kDescribed) + kThreads + kListener + kRan + kListened;
  const auto without = [&](const std::string& event, const std::string& ended) {
    std::istringstream lines(all + ended);
    std::string left;
    for (std::string line; std::getline(lines, line);) {
      if (line.find(event) == std::string::npos) left += line + '\n';
    }
    return analyze_ros2(left).verdict("M2");
  };
  EXPECT_EQ(without("cie:run_end", kEndedThreads), Verdict::fail) << "nothing shows a loss";
  EXPECT_EQ(without("cie:callback_init callback_id=0", kEndedThreads), Verdict::fail)
      << "its instances show which one that is";
  for (const auto* event : {"cie:run_begin", "cie:thread_init tid=2"})
    EXPECT_EQ(without(event, kEndedThreads), Verdict::inconclusive) << event;
}

// A second executor of the process: what it runs was made, and runs, but no own event tells of it.
TEST(BothProviders, WhatAnotherExecutorRunsWasRegistered) {
  const std::string other = R"(
    3 rcl_node_init node_handle=0x18 node_name=b namespace=/
    3 rcl_timer_init timer_handle=0x28 period=9
    3 rclcpp_timer_callback_added timer_handle=0x28 callback=0x38
    3 rclcpp_timer_link_node timer_handle=0x28 node_handle=0x18)";
  const std::string ran = R"(
    4 callback_start tid=9 callback=0x38
    5 callback_end tid=9 callback=0x38
    6 callback_start tid=9 callback=0x38
    7 callback_end tid=9 callback=0x38)";
  const auto judged = [&](const std::string& lines, const std::string& id) {
    return analyze_ros2(std::string(kDescribed) + lines + kRan + kEnded, -1,
                        "callback_groups:\n  - {id: \"" + id + "\"}\n");
  };
  const auto made = judged(other, "/b@Timer(9)");
  EXPECT_EQ(made.verdict("M1"), Verdict::inconclusive);
  EXPECT_THAT(made.evidence("M1"), HasSubstr("it was made in this process"));
  const auto seen = judged(other + ran, "/b@Timer(9)");
  EXPECT_EQ(seen.verdict("M1"), Verdict::pass) << seen.evidence("M1");
  EXPECT_EQ(seen.callback("/b@Timer(9)").instances, 2U);
  EXPECT_NE(seen.verdict("M2"), Verdict::fail) << "on a thread of its own";
  EXPECT_EQ(judged(other + ran, "/c@Timer(9)").verdict("M1"), Verdict::fail);
  EXPECT_EQ(judged("", "/b@Timer(9)").verdict("M1"), Verdict::fail);
}

// Nothing described it: attached late.
TEST(BothProviders, WhatAnotherExecutorRunsIsCountedWhereNothingDescribesIt) {
  const auto result = analyze_ros2(std::string(kDescribed) + kRan + kListened + kEnded);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)", "/n@Subscription(/t)"));
  EXPECT_EQ(
      std::ranges::count(result.analysis.report.defects, analysis::DefectKind::callbacks_beside,
                         &analysis::TraceDefect::kind),
      1);
}

// A worker thread of this project's executors does what these have to do themselves: the services of a
// lifecycle node, those of a container.
TEST(BothProviders, WhatRunsOnAnExecutorsOwnThreadIsNoCallback) {
  const auto judged = [](const std::string& name) {
    return analyze_ros2(std::string(kDescribed) +
                        "\n  3 cie:thread_init tid=9 role=worker callback_id=4294967295 "
                        "group_id=4294967295 start_ns=1 name=" +
                        name + kListener + kRan + kListened + kEnded);
  };
  EXPECT_THAT(judged("cie-rclcpp").logical_ids(),
              ElementsAre("/n@Timer(7)", "/n@Subscription(/t)"));
  EXPECT_EQ(judged("cie-container").verdict("M2"), Verdict::pass);
  EXPECT_EQ(judged("listener").logical_ids().size(), 4U) << "one of the application's";
}

// cie_rclcpp serves what rclcpp has for itself on a thread that runs no callback.
TEST(BothProviders, WhatRclcppServesForItselfIsOfNoOtherExecutor) {
  const std::string subscription = R"(
    3 rcl_subscription_init subscription_handle=0x58 node_handle=0x10 topic_name=)";
  const auto beside = [&](const std::string& topic) {
    const auto result = analyze_ros2(std::string(kDescribed) + subscription + topic + R"(
    3 rclcpp_subscription_init subscription_handle=0x58 subscription=0x48
    3 rclcpp_subscription_callback_added subscription=0x48 callback=0x38
    4 callback_start tid=9 callback=0x38
    5 callback_end tid=9 callback=0x38
    6 callback_start tid=9 callback=0x38
    7 callback_end tid=9 callback=0x38)" +
                                     kRan + kEnded);
    return result.logical_ids().size();
  };
  EXPECT_EQ(beside("/scan"), 3U);
  EXPECT_EQ(beside("/parameter_events"), 2U);
  EXPECT_EQ(beside("/clock"), 2U);
}

// The channel of this project's state is missing as a whole: until the first instance of its own
// nothing tells that ROS 2's events are not all there is, and that what rclcpp has for itself is served
// on one thread.
TEST(BothProviders, WhatRclcppServesForItselfViolatesNothingWithoutThisProjectsState) {
  const std::string served = R"(
    3 rcl_subscription_init subscription_handle=0x58 node_handle=0x10 topic_name=/parameter_events
    3 rclcpp_subscription_init subscription_handle=0x58 subscription=0x48
    3 rclcpp_subscription_callback_added subscription=0x48 callback=0x38
    3 rcl_node_init node_handle=0x18 node_name=b namespace=/
    3 rcl_subscription_init subscription_handle=0x59 node_handle=0x18 topic_name=/parameter_events
    3 rclcpp_subscription_init subscription_handle=0x59 subscription=0x49
    3 rclcpp_subscription_callback_added subscription=0x49 callback=0x39
    4 callback_start tid=9 callback=0x38
    5 callback_end tid=9 callback=0x38
    6 callback_start tid=9 callback=0x39
    7 callback_end tid=9 callback=0x39
    7 callback_start tid=8 callback=0x38
    8 callback_end tid=8 callback=0x38
    8 callback_start tid=9 callback=0x38
    9 callback_end tid=9 callback=0x38)";
  const std::string described = kDescribed;
  const auto of_ros2 = described.substr(0, described.find("  2 cie:run_begin"));
  const auto alone = analyze_ros2(of_ros2 + served);
  const auto both = analyze_ros2(of_ros2 + served + kRan);
  for (const auto* rule : {"M2", "M3"}) {
    EXPECT_EQ(alone.verdict(rule), Verdict::fail) << "a process of rclcpp alone: " << rule;
    EXPECT_EQ(both.verdict(rule), Verdict::inconclusive) << rule << both.evidence(rule);
    EXPECT_THAT(both.evidence(rule), HasSubstr("ROS 2's events alone tell of /n@Subscription("
                                               "/parameter_events)"))
        << rule;
  }
  EXPECT_EQ(alone.callback("/b@Subscription(/parameter_events)").isolation,
            analysis::Isolation::not_isolated);
  EXPECT_EQ(both.callback("/b@Subscription(/parameter_events)").isolation, std::nullopt);
  const auto whole = analyze_ros2(described + served + kRan);
  EXPECT_THAT(whole.evidence("M2"), Not(HasSubstr("thread 9: "))) << "nothing is known of it";
}

// The user's code spins another executor inside a callback, or between two instances.
TEST(BothProviders, WhatAnotherExecutorRunsOnAThreadOfItsOwnFailsThere) {
  const std::string described = std::string(kDescribed) + kThreads + R"(
    3 rcl_node_init node_handle=0x18 node_name=b namespace=/
    3 rcl_timer_init timer_handle=0x28 period=9
    3 rclcpp_timer_callback_added timer_handle=0x28 callback=0x38
    3 rclcpp_timer_link_node timer_handle=0x28 node_handle=0x18)";
  const auto instance = [](int time, int seq, const std::string& inside) {
    const auto at = [time](int after) { return '\n' + std::to_string(time + after); };
    return at(0) + " cie:callback_start tid=2 callback_id=0 release_kind=timer release_ns=" +
           std::to_string(time) + " seq=" + std::to_string(seq) + at(1) +
           " callback_start tid=2 callback=0x30" + inside + at(6) +
           " callback_end tid=2 callback=0x30" + at(7) +
           " cie:callback_end tid=2 callback_id=0 status=ok seq=" + std::to_string(seq);
  };
  const auto other = [](int time) {
    return '\n' + std::to_string(time) + " callback_start tid=2 callback=0x38\n" +
           std::to_string(time + 1) + " callback_end tid=2 callback=0x38";
  };
  const auto sound = analyze_ros2(described + instance(10, 0, "") + instance(20, 1, ""));
  const auto inside = analyze_ros2(described + instance(10, 0, other(12)) + instance(20, 1, ""));
  const auto between =
      analyze_ros2(described + instance(10, 0, "") + other(18) + instance(20, 1, ""));
  // An instance may be missing there, to which the run belongs.
  const auto perhaps_lost =
      analyze_ros2(described + instance(10, 0, "") + other(18) + instance(30, 2, ""));
  EXPECT_NE(sound.verdict("M2"), Verdict::fail);
  EXPECT_EQ(perhaps_lost.verdict("M2"), Verdict::inconclusive) << perhaps_lost.evidence("M2");
  for (const auto* result : {&inside, &between}) {
    EXPECT_EQ(result->verdict("M2"), Verdict::fail);
    EXPECT_THAT(result->evidence("M2"), HasSubstr("/b@Timer(9) started here"));
    EXPECT_EQ(result->callback("/n@Timer(7)").isolation, analysis::Isolation::not_isolated);
  }
  EXPECT_EQ(inside.verdict("E3"), Verdict::fail) << "inside of it";
  EXPECT_NE(between.verdict("E3"), Verdict::fail);
}

}  // namespace
}  // namespace cie::test
