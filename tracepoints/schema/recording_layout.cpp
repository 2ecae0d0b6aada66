#include <cie/tracepoints/recording_layout.hpp>

#include <charconv>
#include <cstring>
#include <system_error>

namespace cie {

std::optional<std::uint32_t> cpu_of(std::string_view file) noexcept {
  const auto bar = file.rfind('_');
  if (bar == std::string_view::npos || bar == 0) return std::nullopt;
  const auto* const end = file.data() + file.size();
  std::uint32_t cpu = 0;
  const auto [rest, error] = std::from_chars(file.data() + bar + 1, end, cpu);
  return error == std::errc() && rest == end ? std::optional(cpu) : std::nullopt;
}

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
