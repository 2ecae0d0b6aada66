#include <cie/tracepoints/recording_layout.hpp>

#include <cstring>

namespace cie {

std::optional<PacketHeader> packet_header(std::span<const std::uint8_t, sizeof(PacketHeader)> bytes,
                                          std::uint64_t left) noexcept {
  PacketHeader header{};
  std::memcpy(&header, bytes.data(), sizeof header);
  const std::uint64_t length = header.packet_bits / 8;
  const bool is_whole = header.magic == kPacketMagic && header.packet_bits % 8 == 0 &&
                        length >= sizeof header && header.content_bits <= header.packet_bits &&
                        length <= left;
  return is_whole ? std::optional(header) : std::nullopt;
}

}  // namespace cie
