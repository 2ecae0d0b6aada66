// SHA-256 of bytes and files, as lower-case hex: identifies a spec and seals a recording's
// manifest.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace cie {

// Never fails for bytes in memory (throws std::bad_alloc only).
std::string sha256_hex(std::string_view bytes);
// Throws std::system_error naming the file when it cannot be read. Reads in blocks.
std::string sha256_file(const std::filesystem::path& file);

}  // namespace cie
