// Names of files, and numbers, in messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace cie::record {

// With quotation marks around it.
std::string in_quotes(const std::filesystem::path& name);
// As a shell takes it for one word: quoted only if it must be.
std::string in_shell_quotes(const std::filesystem::path& path);
// "1 switch", "2 switches".
std::string in_number(std::uint64_t count, std::string_view one, std::string_view many);

}  // namespace cie::record
