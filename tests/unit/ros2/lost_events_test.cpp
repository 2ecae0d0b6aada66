// What a tracer threw away. LTTng loses events behind the last one of a packet, which tells of the loss
// in its header: the loss is somewhere from the packet's begin to its end, and most often at that.
#include "ros2_text.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kSubscription = R"(
  0 rcl_init context_handle=0x1
  0 rcl_node_init node_handle=0x10 node_name=n namespace=/
  0 rcl_publisher_init publisher_handle=0x60 node_handle=0x10 topic_name=/out
  2 rcl_subscription_init subscription_handle=0x21 node_handle=0x10 rmw_subscription_handle=0xa1 topic_name=/t queue_depth=1
  2 rclcpp_subscription_init subscription_handle=0x21 subscription=0x41
  2 rclcpp_subscription_callback_added subscription=0x41 callback=0x51
)";
constexpr const char* kTaker = "/n@Subscription(/t)";

Ros2Result result_of(const std::string& events, const char* spec = "") {
  return analyze_ros2(kSubscription + events, -1, spec);
}

// The end of the run at 3000 and the start of another one are lost at the packet's end.
constexpr const char* kLostAtTheEnd = R"(
  1000 callback_start callback=0x51
  1100 callback_end callback=0x51
  2000 lost until=9100
  2500 callback_start callback=0x51
  2600 callback_end callback=0x51
  3000 callback_start callback=0x51
  9100 callback_end callback=0x51
  12000 callback_start callback=0x51
  12100 callback_end callback=0x51
)";

TEST(Ros2Losses, AnEndAfterOneIsOfNoStartBeforeIt) {
  const auto result = result_of(kLostAtTheEnd);
  const auto& callback = result.callback(kTaker);
  ASSERT_TRUE(callback.duration);
  EXPECT_EQ(callback.duration->count, 3U);
  EXPECT_EQ(callback.duration->max, 100);
}

// Of another CPU's, which lasts much longer.
TEST(Ros2Losses, OneThatGoesOnElsewhereHidesNoOtherOne) {
  const auto result = result_of("  10 lost until=50000\n" + std::string(kLostAtTheEnd));
  EXPECT_EQ(result.callback(kTaker).duration->max, 100);
}

// The node of the first timer is lost, so the second one, made later, may be "#2".
TEST(Ros2Losses, ATimerWhoseNodeWasToldMayBeTheSecondOfItsId) {
  const auto result_with = [](const std::string& first) {
    return analyze_ros2(R"(
  0 rcl_init context_handle=0x1
  1 rcl_node_init node_handle=0x10 node_name=a namespace=/
  2 rcl_timer_init timer_handle=0x20 period=10000000
  3 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
)" + first + R"(
  5000000 rcl_timer_init timer_handle=0x21 period=10000000
  5000001 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
  5000002 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
  10000100 callback_start callback=0x30
  10001100 callback_end callback=0x30
  15000100 callback_start callback=0x31
  24000100 callback_end callback=0x31
)",
                        -1,
                        "callback_groups:\n"
                        "  - {id: \"/a@Timer(10000000)\", response_deadline: 1000000}\n");
  };
  const auto whole = result_with("  4 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10");
  EXPECT_EQ(whole.verdict("R3"), Verdict::pass) << whole.evidence("R3");  // no entry is that of #2
  EXPECT_EQ(result_with("  3 lost until=4").verdict("R3"), Verdict::inconclusive);
}

TEST(Ros2Losses, NoDeadlineIsMissedByRunsThatAreTwo) {
  const auto result =
      result_of(kLostAtTheEnd,
                "callback_groups:\n  - {id: \"/n@Subscription(/t)\", response_deadline: 1us}\n");
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive) << result.evidence("R3");
}

// Of a thread that goes on in another CPU's stream, the first one may have lost an end and a start;
// so it may have at any time while the thread is in the other one.
TEST(Ros2Losses, MeanwhileNothingIsPairedButInTheStreamThatLoses) {
  const auto result = result_of(R"(
    1000 lost until=9000
    1000 callback_start callback=0x51
    1100 callback_end callback=0x51
    1200 callback_start callback=0x51
    1300 callback_end callback=0x51
    1400 callback_start callback=0x51
    7000 callback_end callback=0x51 stream=2
    8000 callback_start callback=0x51 stream=2
    8100 callback_end callback=0x51 stream=2
  )");
  const auto& callback = result.callback(kTaker);
  EXPECT_EQ(callback.instances, 2U);
  EXPECT_EQ(callback.duration->max, 100);
}

// It was there and came back unseen.
TEST(Ros2Losses, NorInAnotherStreamThatSawItAllTheTime) {
  const auto result = result_of(R"(
    1000 lost until=9000 stream=2
    1400 callback_start callback=0x51
    7000 callback_end callback=0x51
    10000 callback_start callback=0x51
    10100 callback_end callback=0x51
  )");
  EXPECT_EQ(result.durations(), "/n@Subscription(/t): 1 of 100 to 100\n");
}

TEST(Ros2Losses, WhereTwoStreamsLoseNothingIsPairedInEither) {
  const auto result = result_of(R"(
    1000 lost until=9000 stream=2
    1000 lost until=8000
    1400 callback_start callback=0x51
    7000 callback_end callback=0x51
    10000 callback_start callback=0x51
    10100 callback_end callback=0x51
  )");
  EXPECT_EQ(result.durations(), "/n@Subscription(/t): 1 of 100 to 100\n");
}

// A packet that has room loses nothing.
TEST(Ros2Losses, ThereIsNoneBeforeItsPacketIsFull) {
  const auto result = result_of(R"(
    1000 lost until=9000 room=5000 stream=2
    1100 callback_start callback=0x51
    1200 callback_end callback=0x51
    1300 callback_start callback=0x51
    1600 callback_end callback=0x51 stream=2
    4600 callback_start callback=0x51
    5000 callback_end callback=0x51
    5001 callback_start callback=0x51
    5501 callback_end callback=0x51
    9000 callback_start callback=0x51
    9700 callback_end callback=0x51
  )");
  EXPECT_EQ(result.durations(), "/n@Subscription(/t): 4 of 100 to 700\n");
}

// What was put into a buffer may have been taken out, and another message put there.
TEST(Ros2Losses, MeanwhileNoQueueTellsWhatReleased) {
  const auto release_of_last = [](const std::string& lost) {
    const auto result = result_of(R"(
      3 rclcpp_buffer_to_ipb buffer=0x80 ipb=0x81
      3 rclcpp_ipb_to_subscription ipb=0x81 subscription=0x41
    )" + lost + R"(
      2000 rclcpp_ring_buffer_enqueue tid=2 buffer=0x80 index=0 size=1 overwritten=0
      8000 rclcpp_ring_buffer_dequeue buffer=0x80 index=0 size=0
      8001 callback_start callback=0x51 is_intra_process=1
      8010 callback_end callback=0x51
    )");
    return result.instances.back().release;
  };
  EXPECT_EQ(release_of_last(""), 2000);
  EXPECT_EQ(release_of_last("1000 lost until=9000 stream=2\n"), -1);
}

// A subscription takes a message and publishes one, which another subscription takes.
std::string taken_and_published(int at, bool is_take_lost) {
  const auto text = [at](int later) { return "  " + std::to_string(at + later) + " "; };
  std::string events;
  if (is_take_lost) {
    events += text(-50) + "lost until=" + std::to_string(at + 5) + "\n";
  } else {
    events += text(0) +
              "rmw_take rmw_subscription_handle=0xa1 message=0x8 taken=1 source_timestamp=" +
              std::to_string(1'000'000 + at - 100) + "\n";
  }
  return events + text(10) + "callback_start callback=0x51\n" + text(20) +
         "rclcpp_publish message=0x9\n" + text(21) +
         "rcl_publish publisher_handle=0x60 message=0x9\n" + text(22) +
         "rmw_publish message=0x9\n" + text(30) + "callback_end callback=0x51\n" + text(40) +
         "rmw_take tid=2 rmw_subscription_handle=0xa2 message=0x8 taken=1 source_timestamp=" +
         std::to_string(1'000'000 + at + 23) + "\n" + text(41) +
         "callback_start tid=2 callback=0x52\n" + text(50) + "callback_end tid=2 callback=0x52\n";
}

// It took something, of whichever chain.
TEST(Ros2Losses, NoChainBeginsWhereATakeWasLost) {
  const std::string both = R"(
    3 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/out queue_depth=1
    3 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
    3 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
  )";
  const auto chains_of = [&](bool is_take_lost) {
    return result_of(both + taken_and_published(1000, false) +
                     taken_and_published(2000, is_take_lost) + taken_and_published(3000, false))
        .chains();
  };
  EXPECT_THAT(chains_of(false), ElementsAre("/n@Subscription(/t) -> /n@Subscription(/out): 3"));
  EXPECT_THAT(chains_of(true), ElementsAre("/n@Subscription(/t) -> /n@Subscription(/out): 2"));
}

// It was there and came back: what began before may have ended there, and another one begun.
TEST(Ros2Losses, NorAcrossAStreamThatTheThreadWasInMeanwhile) {
  const auto result = result_of(R"(
    1000 lost until=9000
    1400 callback_start callback=0x51
    3000 rmw_take rmw_subscription_handle=0xa1 message=0x8 source_timestamp=1000500 taken=1 stream=2
    7000 callback_end callback=0x51
    8000 callback_start callback=0x51
    8100 callback_end callback=0x51
  )");
  EXPECT_EQ(result.callback(kTaker).duration->max, 100);
}

// Runs are counted as they come: numbers in a row do not say that none was between.
TEST(Ros2Losses, ArrivalsBeforeAndAfterOneAreNotInARow) {
  std::string events = R"(
    3 rclcpp_buffer_to_ipb buffer=0x80 ipb=0x81
    3 rclcpp_ipb_to_subscription ipb=0x81 subscription=0x41
  )";
  for (const int at : {1000, 2000, 8000, 9000}) {
    if (at == 8000) events += "  2500 lost until=7000\n";
    const auto text = [at](int later) { return "  " + std::to_string(at + later); };
    events += text(0) + " rclcpp_ring_buffer_enqueue buffer=0x80 index=0 size=1 overwritten=0\n" +
              text(1) + " rclcpp_ring_buffer_dequeue buffer=0x80 index=0 size=0\n" + text(2) +
              " callback_start callback=0x51 is_intra_process=1\n" + text(10) +
              " callback_end callback=0x51\n";
  }
  const auto result = result_of(events);
  const auto& gaps = result.callback(kTaker).inter_arrival;
  ASSERT_TRUE(gaps);
  EXPECT_EQ(gaps->count, 2U);
  EXPECT_EQ(gaps->max, 1000);
}

// What runs may be a callback whose start was lost: it published, and nobody outside callbacks did.
TEST(Ros2Losses, APublicationAfterOneIsOfNobodyKnown) {
  const std::string both = R"(
    3 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/out queue_depth=1
    3 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
    3 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
    1000 callback_start callback=0x51
    1100 callback_end callback=0x51
  )";
  const std::string rest = R"(
    5000 rclcpp_publish publisher_handle=0x60 message=0x9
    5001 rcl_publish publisher_handle=0x60 message=0x9
    5002 rmw_publish message=0x9
    5010 callback_end callback=0x51
    6000 rmw_take rmw_subscription_handle=0xa2 message=0x8 source_timestamp=1005002 taken=1
    6001 callback_start callback=0x52
    6100 callback_end callback=0x52
    7000 callback_start callback=0x52
    7100 callback_end callback=0x52
  )";
  const auto edges_from_outside = [&](const std::string& events) {
    std::uint64_t count = 0;
    for (const auto& edge : result_of(events).analysis.report.edges)
      if (!edge.from) count += edge.messages;
    return count;
  };
  EXPECT_EQ(edges_from_outside(both + rest), 1U);
  EXPECT_EQ(edges_from_outside(both + "  2000 lost until=4000\n" + rest), 0U);
}

// What runs may have ended unseen, and another instance begun: its own end then comes alone.
constexpr const char* kTwoOnAThread = R"(
  3 rcl_subscription_init subscription_handle=0x22 node_handle=0x10 rmw_subscription_handle=0xa2 topic_name=/out queue_depth=1
  3 rclcpp_subscription_init subscription_handle=0x22 subscription=0x42
  3 rclcpp_subscription_callback_added subscription=0x42 callback=0x52
  4 rcl_timer_init timer_handle=0x20 period=7
  4 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  4 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
  1000 callback_start callback=0x51
)";
constexpr const char* kPublishes = R"(
  5000 rclcpp_publish message=0x9
  5001 rcl_publish publisher_handle=0x60 message=0x9
  5002 rmw_publish message=0x9
)";
constexpr const char* kTakes = R"(
  6000 rmw_take tid=2 rmw_subscription_handle=0xa2 message=0x8 source_timestamp=1005002 taken=1
  6001 callback_start tid=2 callback=0x52
  6100 callback_end tid=2 callback=0x52
)";

TEST(Ros2Losses, WhatBeganBeforeOneMayNotPublishAfterIt) {
  const auto result = result_of(std::string(kTwoOnAThread) + "  2000 lost until=4000\n" +
                                kPublishes + "  5010 callback_end callback=0x30\n" + kTakes);
  EXPECT_THAT(result.chains(), IsEmpty());
  EXPECT_THAT(result.analysis.report.edges, IsEmpty());
}

TEST(Ros2Losses, NorWhileItsThreadMayBeOnTheCpuThatLoses) {
  const auto result = result_of("  500 lost until=5500 stream=2\n" + std::string(kTwoOnAThread) +
                                kPublishes + "  5010 callback_end callback=0x51\n" + kTakes);
  EXPECT_THAT(result.chains(), IsEmpty());
}

TEST(Ros2Losses, WithinAPacketThatLostItsEndItMay) {
  const auto result = result_of("  500 lost until=9000\n" + std::string(kTwoOnAThread) +
                                kPublishes + "  5010 callback_end callback=0x51\n" + kTakes);
  EXPECT_THAT(result.chains(), ElementsAre("/n@Subscription(/t) -> /n@Subscription(/out): 1"));
}

// This project's events have numbers, so an end shows what ran all the time.
TEST(Ros2Losses, ANumberedEndShowsWhosePublicationItIs) {
  const std::string described = R"(
    4 cie:run_begin contract_version=1 executor=isolated pid=1 host=h boot_id=b moment=start
    4 cie:node_init node_id=0 name=/n
    4 cie:group_init group_id=0 node_id=0 type=mutually_exclusive
    4 cie:callback_init callback_id=0 node_id=0 group_id=0 kind=subscription logical_id=/n@Subscription(/t) source=/t next_seq=0
    4 cie:callback_init callback_id=1 node_id=0 group_id=0 kind=subscription logical_id=/n@Subscription(/out) source=/out next_seq=0
    1000 cie:callback_start callback_id=0 seq=0 release_kind=data release_ns=900
    2000 lost until=4000
  )";
  const std::string takes = R"(
    7000 cie:callback_start tid=2 callback_id=1 seq=0 release_kind=data release_ns=6900 source_timestamp_realtime_ns=1005002 writer_gid=0
    7100 cie:callback_end tid=2 callback_id=1 seq=0 status=ok
  )";
  const auto with_end = [&](const std::string& end) {
    return result_of(described + kPublishes + "  6000 cie:callback_end " + end + " status=ok\n" +
                     takes);
  };
  EXPECT_THAT(with_end("callback_id=0 seq=0").chains(),
              ElementsAre("/n@Subscription(/t) -> /n@Subscription(/out): 1"));
  EXPECT_THAT(with_end("callback_id=0 seq=1").chains(), IsEmpty());
}

}  // namespace
}  // namespace cie::test
