// A process of rclcpp that tells in this project's events, too: a timer that publishes what a subscription takes.
#pragma once

namespace cie::test {

// ROS 2's descriptions come first: nodes are made before the executor begins.
inline constexpr const char* kDescribed = R"(
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
inline constexpr const char* kRan = R"(
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

inline constexpr const char* kEnded = R"(
  30 cie:callback_fini callback_id=0 started=1 ended=1 released=0 overwritten=0 lost=0
  30 cie:callback_fini callback_id=1 started=1 ended=1 released=0 overwritten=0 lost=0
  31 cie:run_end callbacks=2 threads=0 groups=2 publishers=0 status=0)";

}  // namespace cie::test
