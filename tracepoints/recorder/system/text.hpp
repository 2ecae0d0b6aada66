// Names of files in messages.
#pragma once

#include <filesystem>
#include <string>

namespace cie::record {

// With quotation marks around it.
std::string in_quotes(const std::filesystem::path& name);
// As a shell takes it for one word: quoted only if it must be.
std::string in_shell_quotes(const std::filesystem::path& path);

}  // namespace cie::record
