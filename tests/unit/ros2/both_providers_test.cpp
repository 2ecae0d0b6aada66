// Processes of rclcpp that tell in this project's events, too: what runs is told by these, and ROS
// 2's add what was published.
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
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// ROS 2's descriptions come first: nodes are made before the executor begins.
constexpr const char* kDescribed = R"(
  0 rcl_init context_handle=0x1
  1 rcl_node_init node_handle=0x10 node_name=n namespace=/
  1 rcl_publisher_init publisher_handle=0x15 node_handle=0x10 topic_name=/t
  1 rcl_timer_init timer_handle=0x20 period=7
  1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
  1 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 topic_name=/t queue_depth=1
  1 rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
  1 rclcpp_subscription_callback_added subscription=0x41 callback=0x31
  1 rcl_client_init client_handle=0x50 node_handle=0x10 service_name=/enable rmw_client_handle=0x51
  2 cie:run_begin contract_version=1 executor=isolated pid=1 host=h boot_id=b moment=start
  2 cie:node_init node_id=0 name=/n
  2 cie:group_init group_id=0 node_id=0 type=mutually_exclusive
  2 cie:group_init group_id=1 node_id=0 type=mutually_exclusive
  2 cie:callback_init callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(7) period_ns=7 next_seq=0
  2 cie:callback_init callback_id=1 node_id=0 group_id=1 kind=subscription logical_id=/n@Subscription(/t) source=/t next_seq=0)";

// The timer publishes, and the subscription takes it; both are told twice.
constexpr const char* kRan = R"(
  10 cie:callback_start tid=2 callback_id=0 seq=0 release_kind=timer release_ns=9
  11 callback_start tid=2 callback=0x30
  12 rclcpp_publish tid=2 message=0x99
  13 rcl_publish tid=2 publisher_handle=0x15 message=0x99
  14 rmw_publish tid=2 message=0x99
  16 callback_end tid=2 callback=0x30
  17 cie:callback_end tid=2 callback_id=0 seq=0 status=ok
  19 rclcpp_executor_wait_for_work tid=3 timeout=-1
  19 rclcpp_executor_get_next_ready tid=3
  20 rmw_take tid=3 source_timestamp=1000015 taken=1
  21 cie:callback_start tid=3 callback_id=1 seq=0 release_kind=data release_ns=18 source_timestamp_realtime_ns=1000015 writer_gid=0
  22 callback_start tid=3 callback=0x31
  23 callback_end tid=3 callback=0x31
  25 cie:callback_end tid=3 callback_id=1 seq=0 status=ok)";

constexpr const char* kEnded = R"(
  30 cie:callback_fini callback_id=0 started=1 ended=1 released=0 overwritten=0 lost=0
  30 cie:callback_fini callback_id=1 started=1 ended=1 released=0 overwritten=0 lost=0
  31 cie:run_end callbacks=2 threads=0 groups=2 publishers=0 status=0)";

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
  const std::string described = std::string(kDescribed) + R"(
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
