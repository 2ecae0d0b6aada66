// A program of ROS 2 as LTTng sees it: a provider `ros2` of its own and none of `cie`. The node
// /robot/leg has a timer that runs five times.
//
//   ros2_app [FILE]        FILE: writes it at its begin and runs when its events are recorded
//   ros2_app FILE later    the same in two steps: makes its objects, writes FILE, and runs when that is recorded
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "provider/ros2_provider.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <thread>

namespace {

// Addresses of objects.
constexpr std::uint64_t kContext = 0x1000;
constexpr std::uint64_t kNode = 0x2000;
constexpr std::uint64_t kTimer = 0x3000;
constexpr std::uint64_t kCallback = 0x4000;

bool are_objects_recorded() {
  return lttng_ust_tracepoint_enabled(ros2, rcl_init) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, rcl_node_init) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, rcl_timer_init) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, rclcpp_timer_callback_added) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, rclcpp_callback_register) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, rclcpp_timer_link_node) != 0;
}

bool are_runs_recorded() {
  return lttng_ust_tracepoint_enabled(ros2, callback_start) != 0 &&
         lttng_ust_tracepoint_enabled(ros2, callback_end) != 0;
}

template <typename Condition>
void wait_until(const Condition& is_recorded) {
  using namespace std::chrono_literals;
  while (!is_recorded())
    std::this_thread::sleep_for(10ms);
  // LTTng's thread enables tracepoints first and its session then, which nothing tells.
  std::this_thread::sleep_for(500ms);
}

void make_objects() {
  lttng_ust_tracepoint(ros2, rcl_init, kContext, "4.1.1");
  lttng_ust_tracepoint(ros2, rcl_node_init, kNode, kNode + 1, "leg", "/robot");
  lttng_ust_tracepoint(ros2, rcl_timer_init, kTimer, 20'000'000);
  lttng_ust_tracepoint(ros2, rclcpp_timer_callback_added, kTimer, kCallback);
  lttng_ust_tracepoint(ros2, rclcpp_callback_register, kCallback, "Leg::step()");
  lttng_ust_tracepoint(ros2, rclcpp_timer_link_node, kTimer, kNode);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace std::chrono_literals;
  const auto tell = [argv] { std::ofstream{std::filesystem::path(argv[1])} << "ready"; };
  const bool runs_later = argc > 2;
  if (runs_later) {
    wait_until(are_objects_recorded);
    make_objects();
    tell();
    wait_until(are_runs_recorded);
  } else {
    if (argc > 1) {
      tell();
      wait_until([] { return are_objects_recorded() && are_runs_recorded(); });
    }
    make_objects();
  }
  for (int i = 0; i < 5; ++i) {
    std::this_thread::sleep_for(20ms);
    lttng_ust_tracepoint(ros2, callback_start, kCallback, 0);
    lttng_ust_tracepoint(ros2, callback_end, kCallback);
  }
}
