// SHA-256 of bytes and files (FIPS 180-4): identifies a spec and seals a recording's manifest.
// Thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace cie {

// These two never fail for bytes in memory (throw std::bad_alloc only).
std::array<std::uint8_t, 32> sha256(std::string_view bytes);
// As lower-case hex.
std::string sha256_hex(std::string_view bytes);
// The same of a file. Throws std::system_error naming it when it cannot be read. Reads in blocks.
std::string sha256_file(const std::filesystem::path& file);

}  // namespace cie
