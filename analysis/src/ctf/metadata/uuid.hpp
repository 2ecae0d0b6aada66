// The uuid of a trace or clock.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace cie::analysis::ctf {

using Uuid = std::array<std::uint8_t, 16>;

// "3ec751a9-cc27-…" as bytes; empty if it is none.
std::optional<Uuid> parse_uuid(std::string_view text) noexcept;

}  // namespace cie::analysis::ctf
