#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>

#include <rcl/types.h>

enum rcl_clock_type_t { RCL_CLOCK_UNINITIALIZED, RCL_ROS_TIME, RCL_SYSTEM_TIME, RCL_STEADY_TIME };
enum rcl_clock_change_t {
  RCL_ROS_TIME_NO_CHANGE = 1,
  RCL_ROS_TIME_ACTIVATED,
  RCL_ROS_TIME_DEACTIVATED,
  RCL_SYSTEM_TIME_NO_CHANGE
};
struct rcl_duration_t {
  std::int64_t nanoseconds;
};
struct rcl_time_jump_t {
  rcl_clock_change_t clock_change;
  rcl_duration_t delta;
};
struct rcl_jump_threshold_t {
  bool on_clock_change;
  rcl_duration_t min_forward;
  rcl_duration_t min_backward;
};

// Told before and after a jump.
struct JumpListener {
  rcl_jump_threshold_t threshold{};
  std::function<void(const rcl_time_jump_t&, bool is_before)> told{};
};

struct rcl_clock_t {
  rcl_clock_type_t type = RCL_STEADY_TIME;
  std::recursive_mutex mutex{};  // of what follows
  bool is_overridden = false;
  std::int64_t ros_now = 0;
  int next_listener = 0;
  std::map<int, JumpListener> listeners{};
};

rcl_ret_t rcl_clock_get_now(rcl_clock_t* clock, std::int64_t* now);
rcl_ret_t rcl_enable_ros_time_override(rcl_clock_t* clock);
rcl_ret_t rcl_disable_ros_time_override(rcl_clock_t* clock);
rcl_ret_t rcl_is_enabled_ros_time_override(rcl_clock_t* clock, bool* is_enabled);
rcl_ret_t rcl_set_ros_time_override(rcl_clock_t* clock, std::int64_t now);
int add_jump_listener(rcl_clock_t& clock, JumpListener listener);
void remove_jump_listener(rcl_clock_t& clock, int listener);
