// Processes of this project that tell the same in ROS 2's words: the profile `ros2`.
#include <cie/tracepoints/ros2_profile.hpp>

#include "ros2_text.hpp"

#include <iomanip>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using testing::ElementsAre;

constexpr std::uint32_t kPid = 1;

std::string handle(Ros2Object object, std::uint32_t id) {
  std::ostringstream text;
  text << "0x" << std::hex << ros2_handle(object, kPid, id);
  return text.str();
}

const std::string kNode = handle(Ros2Object::node, 0);
const std::string kTimer = handle(Ros2Object::timer, 0);
const std::string kCallback = handle(Ros2Object::callback, 0);
const std::string kPublisher = handle(Ros2Object::publisher, 0);

std::string own_events() {
  return R"(
    0 cie:run_begin contract_version=1 executor=isolated pid=1 tid=1 host=h boot_id=b
    1 cie:node_init node_id=0 name=/n
    2 cie:callback_init callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(7) period_ns=7 next_seq=0)";
}

std::string profile_events() {
  return "\n 3 rcl_node_init node_handle=" + kNode + " node_name=n namespace=/" +
         "\n 3 rcl_timer_init timer_handle=" + kTimer + " period=7" +
         "\n 3 rclcpp_timer_callback_added timer_handle=" + kTimer + " callback=" + kCallback +
         "\n 3 rclcpp_timer_link_node timer_handle=" + kTimer + " node_handle=" + kNode +
         "\n 3 rcl_publisher_init publisher_handle=" + kPublisher + " node_handle=" + kNode +
         " topic_name=/t";
}

std::string own_instance() {
  return R"(
    10 cie:callback_start callback_id=0 seq=0 release_kind=timer release_ns=9
    20 cie:callback_end callback_id=0 seq=0 status=ok)";
}

std::string profile_instance(int start, int end) {
  return "\n " + std::to_string(start) + " callback_start callback=" + kCallback + "\n " +
         std::to_string(end) + " callback_end callback=" + kCallback;
}

TEST(Ros2Profile, AHandleIsNobodyElsesAndNoAddress) {
  std::set<std::uint64_t> seen;
  for (const auto object : {Ros2Object::context, Ros2Object::node, Ros2Object::taken_message}) {
    for (const std::uint32_t pid : {1U, 2U, (1U << 22U) - 1}) {
      for (const std::uint32_t id : {0U, 1U, (1U << 22U) - 1}) {
        const std::uint64_t handle = ros2_handle(object, pid, id);
        EXPECT_TRUE(seen.insert(handle).second);
        EXPECT_TRUE(is_ros2_profile_handle(handle));
        EXPECT_GE(handle, std::uint64_t{1} << 48U) << "beyond what a program can address";
        EXPECT_EQ(static_cast<std::uint64_t>(static_cast<double>(handle)), handle);
      }
    }
  }
  EXPECT_FALSE(is_ros2_profile_handle(0));
  EXPECT_FALSE(is_ros2_profile_handle(0x7fff'ffff'ffff));
  EXPECT_FALSE(is_ros2_profile_handle(0xffff'ffff'ffff'ffff));
}

TEST(Ros2Profile, AloneItIsReadLikeARecordingOfRos2) {
  const auto result = analyze_ros2(profile_events() + profile_instance(11, 19));
  EXPECT_EQ(result.durations(), "/n@Timer(7): 1 of 8 to 8\n");
}

TEST(Ros2Profile, WhatAProcessSaysInBothWordsCountsOnce) {
  const auto result = analyze_ros2(own_events() + profile_events() + R"(
    10 cie:callback_start callback_id=0 seq=0 release_kind=timer release_ns=9)" +
                                   profile_instance(11, 19) + R"(
    20 cie:callback_end callback_id=0 seq=0 status=ok)");
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)"));
  EXPECT_EQ(result.durations(), "/n@Timer(7): 1 of 10 to 10\n");
}

TEST(Ros2Profile, WhatRunsBeforeTheAnnouncementIsNotTakenForAnUnknownCallback) {
  // A recording that began while the process ran: its announcement comes a moment later.
  const auto result = analyze_ros2(
      "0 callback_start callback=" + kCallback + "\n0 rclcpp_publish message=0x99" +
      "\n0 rcl_publish message=0x99 publisher_handle=" + kPublisher +
      "\n0 callback_end callback=" + kCallback + own_events() + profile_events() + own_instance());
  EXPECT_THAT(result.logical_ids(), ElementsAre("/n@Timer(7)"));
  EXPECT_EQ(result.durations(), "/n@Timer(7): 1 of 10 to 10\n");
}

TEST(Ros2Profile, WaitsAreToldOnce) {
  // The thread returned from a wait at 8, by its own word; in ROS 2's words a little later.
  const auto result = analyze_ros2(own_events() + profile_events() + R"(
    7 rclcpp_executor_wait_for_work timeout=-1
    8 cie:thread_wakeup callback_id=0 reason=timer
    9 rclcpp_executor_get_next_ready)" +
                                   own_instance());
  ASSERT_EQ(result.instances.size(), 1U);
  EXPECT_EQ(result.instances.front().wakeup, 8);
}

TEST(Ros2Profile, AnotherProcessOfRos2IsReadAsEver) {
  const auto result = analyze_ros2(own_events() + profile_events() + R"(
    4 rcl_node_init pid=2 tid=2 node_handle=0x10 node_name=m namespace=/
    4 rcl_timer_init pid=2 tid=2 timer_handle=0x20 period=5
    4 rclcpp_timer_callback_added pid=2 tid=2 timer_handle=0x20 callback=0x30
    4 rclcpp_timer_link_node pid=2 tid=2 timer_handle=0x20 node_handle=0x10)" +
                                   own_instance() + R"(
    30 callback_start pid=2 tid=2 callback=0x30
    33 callback_end pid=2 tid=2 callback=0x30)");
  EXPECT_EQ(result.durations(), "/n@Timer(7): 1 of 10 to 10\n/m@Timer(5): 1 of 3 to 3\n");
}

}  // namespace
}  // namespace cie::test
