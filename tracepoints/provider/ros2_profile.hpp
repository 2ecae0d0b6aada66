// The profile `ros2` as the registry and the hot functions see it: functions of a library of its
// own, which is loaded only where the environment asks for it. Without it nothing of the process
// knows LTTng's provider `ros2`, and the hot path pays one test of a pointer.
#pragma once

#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <cstdint>

namespace cie::trace {

// All are thread-safe and never throw; each emits what ROS 2 would at that moment. The states are
// only read.
struct Ros2Profile {
  bool (*is_enabled)() noexcept;  // whether some session records events of it in this process
  void (*run_begin)() noexcept;
  void (*node_init)(NodeId node, const char* name) noexcept;
  void (*callback_init)(const CallbackState& callback) noexcept;
  void (*publisher_init)(const PublisherState& publisher) noexcept;
  void (*callback_start)(const CallbackState& callback, std::uint64_t seq,
                         const Callback::Release& release) noexcept;
  void (*callback_end)(const CallbackState& callback) noexcept;
  void (*publish)(PublisherId publisher, std::uint64_t seq,
                  std::int64_t source_timestamp_realtime_ns) noexcept;
  void (*before_wait)(std::int64_t deadline_ns) noexcept;
  void (*after_wait)() noexcept;
};

// Name of the one symbol of that library, a Ros2Profile.
inline constexpr const char* kRos2ProfileSymbol = "cie_ros2_profile";

namespace detail {
extern std::atomic<const Ros2Profile*> ros2_profile;
}

// Null unless the process has the profile.
inline const Ros2Profile* ros2_profile() noexcept {
  return detail::ros2_profile.load(std::memory_order_acquire);
}

// Loads what the environment variable CIE_TRACE_PROFILE asks for; not thread-safe. Throws
// std::runtime_error if that is unknown or cannot be had.
void load_profile();

}  // namespace cie::trace
