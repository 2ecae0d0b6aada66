// A ROS 2 node with a timer of 10 ms, as text.
#pragma once

#include "ros2_text.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cie::test::timers {

inline constexpr std::int64_t kUs = 1'000;
inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kPeriod = 10 * kMs;
inline constexpr std::int64_t kMade = 5 * kMs;
inline constexpr auto kId = "/n@Timer(10000000)";

// The earliest that expiry k, of 1, 2, …, can be at: rcl has read the clock up to 10 us before it
// tells that the timer is made.
constexpr std::int64_t expiry(std::int64_t k) { return kMade - 10 * kUs + k * kPeriod; }

class Text {
 public:
  // `before`: so long before the timer is made its thread did something else.
  explicit Text(bool does_wait = true, const std::string& node = "0x10",
                std::int64_t before = 10 * kUs)
      : does_wait_(does_wait) {
    add(0, "rcl_node_init node_handle=0x10 node_name=n namespace=/");
    add(kMade - before, "rclcpp_callback_register callback=0x30 symbol=tick");
    add(kMade, "rcl_timer_init timer_handle=0x20 period=" + std::to_string(kPeriod));
    add(kMade, "rclcpp_timer_callback_added timer_handle=0x20 callback=0x30");
    add(kMade, "rclcpp_timer_link_node timer_handle=0x20 node_handle=" + node);
  }
  Text& add(std::int64_t time, const std::string& event) {
    text_ += std::to_string(time) + ' ' + event + '\n';
    return *this;
  }
  // Another timer of the node, with callback 0x31.
  Text& add_other_timer(std::int64_t period = 1000 * kMs) {
    add(kMade, "rcl_timer_init timer_handle=0x21 period=" + std::to_string(period));
    add(kMade, "rclcpp_timer_callback_added timer_handle=0x21 callback=0x31");
    return add(kMade, "rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10");
  }
  // The executor, before that instance starts.
  Text& wait(std::int64_t start) {
    add(start - 2, "rclcpp_executor_wait_for_work timeout=1");
    return add(start - 1, "rclcpp_executor_get_next_ready");
  }
  // An instance that the executor has waited for.
  Text& run(std::int64_t start, std::int64_t duration = kMs) {
    if (does_wait_) wait(start);
    return run_next(start, duration);
  }
  Text& run_next(std::int64_t start, std::int64_t duration = kMs) {
    add(start, "callback_start callback=0x30");
    return add(start + duration, "callback_end callback=0x30");
  }
  Ros2Result analyze(std::int64_t lost_at = -1, std::string_view spec = {}) const {
    return analyze_ros2(text_, lost_at, spec);
  }
  Ros2Result analyze_from(std::int64_t begin) const {
    return analyze_in({.from = analysis::Timestamp{begin}});
  }
  Ros2Result analyze_in(const analysis::TimeWindow& window, std::string_view spec = {}) const {
    return analyze_ros2(text_, -1, spec, window);
  }

 private:
  bool does_wait_;
  std::string text_;
};

// By start: rows come as their releases are proven.
inline std::vector<std::int64_t> releases(const Ros2Result& result) {
  auto rows = result.instances;
  std::ranges::stable_sort(rows, {}, &InstanceRow::start);
  std::vector<std::int64_t> times;
  for (const auto& row : rows)
    times.push_back(row.release);
  return times;
}

// A spec.
inline std::string deadline_us(std::int64_t us) {
  return "callback_groups:\n  - {id: \"/n@Timer(10000000)\", response_deadline: " +
         std::to_string(us * kUs) + "}\n";
}

}  // namespace cie::test::timers
