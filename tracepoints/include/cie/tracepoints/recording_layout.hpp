// What a recording of `cie record` is on disk: its channels, the files of their streams, how packets
// begin. The recorder has it written so; an analyzer relies on it where metadata is lost.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace cie {

// Two channels: `state` holds the events that describe objects and clocks (and are few), so that no
// burst of the others can cost them; `events` holds all others.
inline constexpr const char* kStateChannel = "state";
inline constexpr const char* kEventChannel = "events";
// The same for the profile `ros2`, whose readers want every event's process name.
inline constexpr const char* kRos2StateChannel = "ros2_state";
inline constexpr const char* kRos2EventChannel = "ros2";

// Full names of what is in `state`, in the order in which the provider defines them.
inline constexpr std::array<std::string_view, 13> kStateEvents{"cie:run_begin",
                                                               "cie:run_end",
                                                               "cie:node_init",
                                                               "cie:group_init",
                                                               "cie:callback_init",
                                                               "cie:callback_fini",
                                                               "cie:publisher_init",
                                                               "cie:publisher_fini",
                                                               "cie:thread_init",
                                                               "cie:thread_fini",
                                                               "cie:thread_sched",
                                                               "cie:clock_sync",
                                                               "lttng_ust_statedump:procname"};

// "ros2_state" of "ros2_state_1", the file of CPU 1; the name itself if it is no stream's.
constexpr std::string_view channel_of(std::string_view file) noexcept {
  return file.substr(0, file.rfind('_'));
}
// 1 of it; empty if it is no stream's.
std::optional<std::uint32_t> cpu_of(std::string_view file) noexcept;

// Buffers of each CPU: bytes of a sub-buffer, and how many. Those of the channels that describe, and
// those of the others if the user does not ask for more.
inline constexpr std::uint64_t kStateSubbufSize = 512UL * 1024;
inline constexpr std::uint64_t kStateSubbufs = 4;
inline constexpr std::uint64_t kDefaultSubbufSize = 1UL << 20;
inline constexpr std::uint64_t kDefaultSubbufs = 8;

// A packet of CTF begins with it.
inline constexpr std::uint32_t kPacketMagic = 0xC1FC1FC1;

// Packet header and context as LTTng-UST 2.13 writes them, in the byte order of this machine. The
// kernel's streams, which the recorder writes, begin alike.
struct PacketHeader {
  std::uint32_t magic;
  std::array<std::uint8_t, 16> trace_uuid;
  std::uint32_t stream_id;
  std::uint64_t stream_instance_id;
  std::uint64_t begin;
  std::uint64_t end;
  std::uint64_t content_bits;
  std::uint64_t packet_bits;
  std::uint64_t number;  // contiguous from 0 in a stream
  std::uint64_t discarded_events;
};
static_assert(sizeof(PacketHeader) == 80);

// What a packet without an event holds: this, and the number of its CPU.
inline constexpr std::uint64_t kEmptyPacketBytes = sizeof(PacketHeader) + sizeof(std::uint32_t);

// Of a packet that begins with `bytes`, in a file that has so many bytes from there on. Empty: it is
// none of LTTng-UST's, or not whole.
std::optional<PacketHeader> packet_header(std::span<const std::uint8_t, sizeof(PacketHeader)> bytes,
                                          std::uint64_t left) noexcept;

}  // namespace cie
