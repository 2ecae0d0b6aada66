// Processes of rclcpp that tell in this project's events, too: what runs is told by these, and ROS
// 2's add what was published.
#include "both_providers.hpp"

#include "ros2_text.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kAll = std::string(kDescribed) + kRan + kEnded;

TEST(BothProviders, AnInstanceCountsOnce) {
  const auto result = analyze_ros2(kAll);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)", "/n@Subscription(/t)"));
  EXPECT_EQ(result.durations(), "/n@Timer(7): 1 of 7 to 7\n/n@Subscription(/t): 1 of 4 to 4\n");
  ASSERT_EQ(result.instances.size(), 2U);
  EXPECT_EQ(result.instances[1].wakeup, -1) << "this project's wake-ups count, and there is none";
}

// Whichever of them are lost.
TEST(BothProviders, AnInstanceCountsOnceWithoutTheEventsThatAnnounceIt) {
  const auto without = [](const std::vector<std::string>& lost) {
    std::istringstream lines(kAll);
    std::string left;
    for (std::string line; std::getline(lines, line);) {
      const auto is_in_line = [&line](const std::string& event) {
        return line.find(event) != std::string::npos;
      };
      if (std::ranges::none_of(lost, is_in_line)) left += line + '\n';
    }
    return analyze_ros2(left);
  };
  const auto runs = [](const auto& result) {
    std::uint64_t all = 0;
    for (const auto& callback : result.analysis.report.callbacks)
      all += callback.instances;
    return all;
  };
  EXPECT_EQ(runs(without({"cie:run_begin"})), 2U);
  EXPECT_EQ(runs(without({"cie:run_begin", "cie:callback_init"})), 2U)
      << "no callback is known by its id";
}

TEST(BothProviders, WhatOnlyRos2TellsOfThePublicationIsAChain) {
  const auto result = analyze_ros2(kAll);
  EXPECT_THAT(result.chains(), ElementsAre("/n@Timer(7) -> /n@Subscription(/t): 1"));
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  const auto& latency = result.analysis.report.chains.front().path_latency;
  ASSERT_TRUE(latency.has_value());
  EXPECT_EQ(latency->max, 25 - 9);
}

// The same within the process: the message is put into a buffer, and taken from it right before the
// instance is told.
constexpr const char* kBuffer = R"(
  3 rclcpp_buffer_to_ipb buffer=0x80 ipb=0x81
  3 rclcpp_ipb_to_subscription ipb=0x81 subscription=0x41)";

constexpr const char* kPublishedInside = R"(
  10 cie:callback_start tid=2 callback_id=0 seq=0 release_kind=timer release_ns=9
  11 callback_start tid=2 callback=0x30
  12 rclcpp_intra_publish tid=2 publisher_handle=0x15 message=0x99
  13 rclcpp_ring_buffer_enqueue tid=2 buffer=0x80 index=0 size=1 overwritten=0
  16 callback_end tid=2 callback=0x30
  17 cie:callback_end tid=2 callback_id=0 seq=0 status=ok)";

constexpr const char* kTakenInside = R"(
  21 cie:callback_start tid=3 callback_id=1 seq=0 release_kind=data release_ns=14 source_timestamp_realtime_ns=0 writer_gid=0
  22 callback_start tid=3 callback=0x31 is_intra_process=1
  23 callback_end tid=3 callback=0x31
  25 cie:callback_end tid=3 callback_id=1 seq=0 status=ok)";

constexpr const char* kDequeued = R"(
  20 rclcpp_ring_buffer_dequeue tid=3 buffer=0x80 index=0 size=0)";

TEST(BothProviders, AMessageThatStaysInTheProcessIsAChain) {
  const auto result = analyze_ros2(std::string(kDescribed) + kBuffer + kPublishedInside +
                                   kDequeued + kTakenInside + kEnded);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)", "/n@Subscription(/t)"));
  EXPECT_THAT(result.chains(), ElementsAre("/n@Timer(7) -> /n@Subscription(/t): 1"));
  ASSERT_EQ(result.analysis.report.chains.size(), 1U);
  const auto& latency = result.analysis.report.chains.front().path_latency;
  ASSERT_TRUE(latency.has_value());
  EXPECT_EQ(latency->max, 25 - 9);
  EXPECT_EQ(result.callback("/n@Subscription(/t)").response_time->max, 25 - 14)
      << "this project's release counts";
  for (const auto* rule : {"T4", "E1", "Q1"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule << '\n' << result.evidence(rule);
}

TEST(BothProviders, AMessageThatGoesToOtherProcessesTooCountsOnce) {
  std::string published = kPublishedInside;
  published.insert(published.find("  16 callback_end"), R"(  14 rclcpp_publish tid=2 message=0x99
  14 rcl_publish tid=2 publisher_handle=0x15 message=0x99
  15 rmw_publish tid=2 message=0x99 timestamp=1000015
)");
  const auto result =
      analyze_ros2(std::string(kDescribed) + kBuffer + published + kDequeued + kTakenInside);
  EXPECT_THAT(result.chains(), ElementsAre("/n@Timer(7) -> /n@Subscription(/t): 1"));
}

// What an earlier instance took, or one of another executor, is not this one's.
TEST(BothProviders, AnInstanceWithoutAMessageOfItsOwnIsOfNoChain) {
  const std::string described = std::string(kDescribed) + kBuffer + kPublishedInside;
  EXPECT_THAT(analyze_ros2(described + kTakenInside).chains(), IsEmpty());
  EXPECT_THAT(analyze_ros2(described + kDequeued + R"(
  20 callback_start tid=3 callback=0x31 is_intra_process=1
  20 callback_end tid=3 callback=0x31)" +
                           kTakenInside)
                  .chains(),
              IsEmpty());
  EXPECT_THAT(analyze_ros2(described + R"(
  18 lost until=19)" + kDequeued +
                           kTakenInside)
                  .chains(),
              IsEmpty());
}

TEST(BothProviders, TotalsAreThoseOfThisProjectsEvents) {
  const auto result = analyze_ros2(kAll);
  for (const auto* rule : {"T3", "T4", "M2", "M3", "M4", "M7", "E1", "E2", "E3", "Q1"})
    EXPECT_EQ(result.verdict(rule), Verdict::pass) << rule << '\n' << result.evidence(rule);
}

TEST(BothProviders, ACallbackThatOnlyRos2TellsOfIsLeftOut) {
  const auto result = analyze_ros2(std::string(kDescribed) + R"(
    3 rcl_service_init service_handle=0x60 node_handle=0x10 service_name=/get_parameters
    3 rclcpp_service_callback_added service_handle=0x60 callback=0x61
    4 callback_start tid=9 callback=0x61
    5 callback_end tid=9 callback=0x61)" +
                                   kRan + kEnded);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)", "/n@Subscription(/t)"));
}

TEST(BothProviders, WhatBeganBeforeTheExecutorDidEnds) {
  const std::string before = kDescribed;
  const auto run_begin = before.find("  2 cie:run_begin");
  const auto result =
      analyze_ros2(before.substr(0, run_begin) + "  2 callback_start tid=4 callback=0x30\n" +
                   before.substr(run_begin) + "\n 8 callback_end tid=4 callback=0x30");
  ASSERT_EQ(result.instances.size(), 1U);
  EXPECT_EQ(result.instances.front().end, 8);
}

TEST(BothProviders, PublicationsThatThisProjectTellsOfCountOnce) {
  const auto result = analyze_ros2(std::string(kDescribed) + R"(
    3 cie:publisher_init publisher_id=0 node_id=0 topic=/t writer_gid=77 next_seq=0
    10 cie:callback_start tid=2 callback_id=0 seq=0 release_kind=timer release_ns=9
    12 rclcpp_publish tid=2 message=0x99
    13 rcl_publish tid=2 publisher_handle=0x15 message=0x99
    14 rmw_publish tid=2 message=0x99
    15 cie:publish tid=2 publisher_id=0 seq=0 source_timestamp_realtime_ns=1000015
    17 cie:callback_end tid=2 callback_id=0 seq=0 status=ok
    21 cie:callback_start tid=3 callback_id=1 seq=0 release_kind=data release_ns=18 source_timestamp_realtime_ns=1000015 writer_gid=77
    25 cie:callback_end tid=3 callback_id=1 seq=0 status=ok)");
  EXPECT_THAT(result.chains(), ElementsAre("/n@Timer(7) -> /n@Subscription(/t): 1"));
}

// Nodes of this project are in one graph with those of rclcpp.
TEST(BothProviders, AProcessOfRos2AloneTakesWhatThisProjectPublishes) {
  const std::string publisher = R"(
  2 cie:run_begin pid=1 contract_version=1 executor=isolated host=h boot_id=b moment=start
  2 cie:node_init pid=1 node_id=0 name=/n
  2 cie:group_init pid=1 group_id=0 node_id=0 type=mutually_exclusive
  2 cie:callback_init pid=1 callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(7) period_ns=7 next_seq=0
  2 cie:publisher_init pid=1 publisher_id=0 node_id=0 topic=/t writer_gid=77 next_seq=0)";
  const std::string subscription = R"(
  2 rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/
  2 rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1
  2 rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40
  2 rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50)";
  const std::string ran = R"(
  10 cie:callback_start pid=1 tid=1 callback_id=0 seq=0 release_kind=timer release_ns=9
  15 cie:publish pid=1 tid=1 publisher_id=0 seq=0 source_timestamp_realtime_ns=1000015
  17 cie:callback_end pid=1 tid=1 callback_id=0 seq=0 status=ok
  20 rmw_take pid=2 tid=2 source_timestamp=1000015 taken=1
  22 callback_start pid=2 tid=2 callback=0x50
  27 callback_end pid=2 tid=2 callback=0x50)";
  for (const auto& result : {analyze_ros2(publisher + subscription + ran),
                             analyze_ros2(subscription + publisher + ran)}) {
    EXPECT_THAT(result.chains(), ElementsAre("/n@Timer(7) -> /b@Subscription(/t): 1"));
    ASSERT_EQ(result.analysis.report.chains.size(), 1U);
    const auto& latency = result.analysis.report.chains.front().path_latency;
    ASSERT_TRUE(latency.has_value());
    EXPECT_EQ(latency->max, 27 - 9);
  }
}

// As long as nobody of ROS 2 speaks, nobody asks for messages. Whoever does then takes the same ones as
// if it had spoken before; what lies too far back is forgotten either way.
TEST(BothProviders, WhatWasPublishedBeforeRos2SpokeIsTaken) {
  constexpr int kMessages = 1'100;  // some more than are remembered of a topic
  std::string publisher = R"(
  2 cie:run_begin pid=1 contract_version=1 executor=isolated host=h boot_id=b moment=start
  2 cie:node_init pid=1 node_id=0 name=/n
  2 cie:group_init pid=1 group_id=0 node_id=0 type=mutually_exclusive
  2 cie:callback_init pid=1 callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(7) period_ns=7 next_seq=0
  2 cie:publisher_init pid=1 publisher_id=0 node_id=0 topic=/t writer_gid=77 next_seq=0
  2 cie:publisher_init pid=1 publisher_id=1 node_id=0 topic=/t writer_gid=78 next_seq=0)";
  for (int i = 0; i < kMessages; ++i) {
    const auto number = std::to_string(i);
    const auto time = 10 * (i + 1);
    const auto id = std::to_string(i % 2);
    publisher += "\n " + std::to_string(time) +
                 " cie:callback_start pid=1 tid=1 callback_id=0 seq=" + number +
                 " release_kind=timer release_ns=" + std::to_string(time) + "\n " +
                 std::to_string(time + 1) + " cie:publish pid=1 tid=1 publisher_id=" + id +
                 " seq=" + std::to_string(i / 2) +
                 " source_timestamp_realtime_ns=" + std::to_string(1'000'000 + time + 1) + "\n " +
                 std::to_string(time + 2) +
                 " cie:callback_end pid=1 tid=1 callback_id=0 seq=" + number + " status=ok";
  }
  const auto subscription_at = [](const std::string& time) {
    std::string text;
    for (
        const auto* event :
        {"rcl_node_init pid=2 node_handle=0x10 node_name=b namespace=/",
         "rcl_subscription_init pid=2 subscription_handle=0x20 node_handle=0x10 topic_name=/t queue_depth=1",
         "rclcpp_subscription_init pid=2 subscription_handle=0x20 subscription=0x40",
         "rclcpp_subscription_callback_added pid=2 subscription=0x40 callback=0x50"})
      text.append("\n ").append(time).append(" ").append(event);
    return text;
  };
  const auto taking = [](int time, int message) {
    const auto stamp = std::to_string(1'000'000 + 10 * (message + 1) + 1);
    return "\n " + std::to_string(time) + " rmw_take pid=2 tid=2 source_timestamp=" + stamp +
           " taken=1\n " + std::to_string(time + 1) +
           " callback_start pid=2 tid=2 callback=0x50\n " + std::to_string(time + 2) +
           " callback_end pid=2 tid=2 callback=0x50";
  };
  const auto ran =
      taking(12'000, 10) + taking(12'010, kMessages - 2) + taking(12'020, kMessages - 1);
  const auto early = analyze_ros2(subscription_at("2") + publisher + ran);
  const auto late = analyze_ros2(publisher + subscription_at("11900") + ran);
  for (const auto* result : {&early, &late}) {
    EXPECT_THAT(result->chains(), ElementsAre("/n@Timer(7) -> /b@Subscription(/t): 2"));
    std::vector<bool> known;
    for (const auto& instance : result->instances) {
      if (instance.start > 12'000) known.push_back(instance.is_from_known_publisher);
    }
    EXPECT_EQ(known, (std::vector{false, true, true})) << "the first one is forgotten";
  }
}

// Nobody declares a deadline to rclcpp: its callback's is unknown, be it restarted with one or without.
TEST(BothProviders, ARestartUnderThisProjectIsNotComparedByDeadline) {
  const std::string plain = R"(
    0 rcl_init pid=7 tid=7 context_handle=0x1
    1 rcl_node_init pid=7 tid=7 node_handle=0x10 node_name=n namespace=/
    2 rcl_timer_init pid=7 tid=7 timer_handle=0x20 period=5
    3 rclcpp_timer_callback_added pid=7 tid=7 timer_handle=0x20 callback=0x30
    4 rclcpp_timer_link_node pid=7 tid=7 timer_handle=0x20 node_handle=0x10
    10 callback_start pid=7 tid=7 callback=0x30
    12 callback_end pid=7 tid=7 callback=0x30
    20 sched:sched_process_exit pid=7 tid=7)";
  for (const auto* deadline : {"0", "3"}) {
    const auto result = analyze_ros2(plain + R"(
      1000 cie:run_begin pid=8 tid=8 contract_version=1 executor=isolated host=h boot_id=b moment=start
      1001 cie:node_init pid=8 tid=8 node_id=0 name=/n
      1002 cie:group_init pid=8 tid=8 group_id=0 node_id=0 type=mutually_exclusive
      1003 cie:callback_init pid=8 tid=8 callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(5) period_ns=5 next_seq=0 deadline_ns=)" +
                                     std::string(deadline));
    EXPECT_EQ(result.verdict("M5"), Verdict::inconclusive) << deadline;
    EXPECT_THAT(result.evidence("M5"), HasSubstr("do not tell whether it had a deadline"));
    EXPECT_THAT(result.evidence("M5"), Not(HasSubstr("deadline 0 ns")));
  }
}

}  // namespace
}  // namespace cie::test
