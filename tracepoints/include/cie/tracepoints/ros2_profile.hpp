// The profile `ros2`: besides its own events a process emits those of ROS 2's tracers, for tools
// that read only these. Writer and readers share how its handles look.
#pragma once

#include <cstdint>
#include <string_view>

namespace cie {

// The environment variable that chooses what a process emits besides `cie:*`, and its one value.
inline constexpr const char* kProfileVariable = "CIE_TRACE_PROFILE";
inline constexpr std::string_view kRos2Profile = "ros2";

// What ROS 2's events know as an object with an address of its own.
enum class Ros2Object : std::uint8_t {
  context,
  node,
  rmw_node,
  publisher,
  rmw_publisher,
  subscription,
  subscription_object,
  rmw_subscription,
  service,
  rmw_service,
  client,
  rmw_client,
  timer,
  callback,
  sent_message,
  taken_message
};

// Handles are no addresses, but numbers that no address of a program can be (beyond what 48 bits
// reach) and that a double holds exactly. They are the machine's, not only the process's, because
// readers of ROS 2's events rely on addresses being random and look things up by them alone.
inline constexpr unsigned kRos2IdBits = 22;
inline constexpr unsigned kRos2PidBits = 22;  // as many as Linux has
inline constexpr unsigned kRos2ObjectBits = 4;
inline constexpr unsigned kRos2TagShift = kRos2IdBits + kRos2PidBits + kRos2ObjectBits;
inline constexpr std::uint64_t kRos2HandleTag = 0xc;

// Of the low kRos2IdBits of `id` and the low kRos2PidBits of `pid`.
constexpr std::uint64_t ros2_handle(Ros2Object object, std::uint32_t pid,
                                    std::uint32_t id) noexcept {
  constexpr std::uint64_t kPidMask = (1U << kRos2PidBits) - 1;
  constexpr std::uint64_t kIdMask = (1U << kRos2IdBits) - 1;
  return kRos2HandleTag << kRos2TagShift |
         std::uint64_t{static_cast<std::uint8_t>(object)} << (kRos2IdBits + kRos2PidBits) |
         (pid & kPidMask) << kRos2IdBits | (id & kIdMask);
}

// Whether the profile made it, rather than a program of ROS 2.
constexpr bool is_ros2_profile_handle(std::uint64_t handle) noexcept {
  return handle >> kRos2TagShift == kRos2HandleTag;
}

}  // namespace cie
