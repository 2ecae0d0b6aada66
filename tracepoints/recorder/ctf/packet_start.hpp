// How every packet of a recording begins.
#pragma once

#include <array>
#include <cstdint>

namespace cie::record {

// Packet header and context as LTTng-UST 2.13 writes them, in the byte order of this machine. The
// kernel's streams, which the recorder writes, begin alike.
struct PacketStart {
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
static_assert(sizeof(PacketStart) == 80);

// What a packet without an event holds: this, and the number of its CPU.
inline constexpr std::uint64_t kEmptyPacketBytes = sizeof(PacketStart) + sizeof(std::uint32_t);

inline constexpr std::uint32_t kPacketMagic = 0xC1FC1FC1;

}  // namespace cie::record
