// Recordings of ROS 2's tracers written as text: `TIME EVENT [pid=N] [tid=N] [cpu=N] [boot=NAME] [stream=2]
// [session=2] FIELD=VALUE …`, one event a line in order of time (nanoseconds). An event without a provider is of "ros2:".
// With a boot it is of another machine, which is called "robot" like the first.
// With session=2 it is of a session that recorded all of the time beside the first one.
// `TIME lost until=TIME [room=TIME] [stream=2]`: a packet that begins there tells that events were lost until its end,
// behind the last event with room for another one if that is told.
// `TIME second_begins`, `TIME second_ends`: the second stream's record, which else is of all the time.
// `TIME session until=TIME`: the session of the first machine ends there, and another one begins then.
// `TIME session of runs until=TIME`: the same, where the first one recorded what is made alone.
// `TIME kernel_begins`, `TIME kernel_ends`: the kernel's record, which else is of all the time.
// `0 no_client_events`: the first session declares no rcl_client_init.
// `TIME kernel_lost TIME`: it has a hole until then. `0 kernel_without_inheritance`: it declares no sched_pi_setprio.
// Values with a digit first are numbers, of gids and CPUs lists of them (1.15.3); all others are texts.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::test {

// CLOCK_REALTIME of these recordings is their time plus this.
inline constexpr std::int64_t kRealtimeOffset = 1'000'000;

// A node "/n" with timers of period 1 (callback 0x30) and 2 (0x31).
inline constexpr const char* kTwoTimers = R"(
  0 rcl_init context_handle=0x1
  0 rcl_node_init node_handle=0x10 node_name=n namespace=/
  1 rcl_timer_init timer_handle=0x20 period=1
  1 rclcpp_timer_callback_added timer_handle=0x20 callback=0x30
  1 rclcpp_timer_link_node timer_handle=0x20 node_handle=0x10
  2 rcl_timer_init timer_handle=0x21 period=2
  2 rclcpp_timer_callback_added timer_handle=0x21 callback=0x31
  2 rclcpp_timer_link_node timer_handle=0x21 node_handle=0x10
)";

// Thread 1 runs the timer with period 1, thread 2 the other one.
inline constexpr const char* kIsolated = R"(
  10 callback_start tid=1 callback=0x30
  11 callback_end tid=1 callback=0x30
  12 callback_start tid=2 callback=0x31
  13 callback_end tid=2 callback=0x31
  20 callback_start tid=1 callback=0x30
  21 callback_end tid=1 callback=0x30
)";

// Thread 7, of the timer with period 1, is switched in and out around an instance. It runs with the
// kernel's `prio` (99 - real-time priority, 120 + nice) on a CPU.
std::string instance(int time, int prio, int cpu = 0);
// The same of which the kernel recorded nothing.
std::string unswitched_instance(int time, int cpu = 0);

// A node "/a" with a timer of that period on thread 1 of process 1, which publishes /t; and a node
// "/b" in process 2 with a subscription to it.
std::string pair_of_period(std::int64_t period);

struct InstanceRow {
  std::string logical_id;
  std::int64_t start = 0;
  std::int64_t end = -1;      // open
  std::int64_t release = -1;  // not known
  std::int64_t wakeup = -1;
  bool is_from_known_publisher = false;
  std::int64_t message = 0;  // its source timestamp or name
  std::optional<std::uint32_t> missed{};
};

struct Ros2Result {
  analysis::AnalysisResult analysis;
  std::vector<InstanceRow> instances;
  std::size_t ended_at_once = 0;  // starts that told of their ends
  std::size_t publications = 0;

  // "ID first..last" of each callback: its smallest and largest duration and their number.
  std::string durations() const;
  const analysis::CallbackReport& callback(std::string_view logical_id) const;
  std::vector<std::string> logical_ids() const;
  std::vector<std::string> chains() const;
  analysis::Verdict verdict(std::string_view rule) const;
  std::string evidence(std::string_view rule) const;
};

// `lost_at`: the tracer threw something away around then; -1: nothing. `spec`: YAML, if any.
Ros2Result analyze_ros2(std::string_view text, std::int64_t lost_at = -1,
                        std::string_view spec = {},
                        std::optional<analysis::TimeWindow> window = {});

}  // namespace cie::test
