// The command line of cie-record.
#pragma once

#include "options/options.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

// Result of the command line: options, or the directory of a recorder that is to save now, or text
// to print for --help and --version.
struct ParsedCommandLine {
  std::optional<Options> options;
  std::optional<std::filesystem::path> save;
  std::string save_reason{};     // empty: none was given
  bool is_kernel_trial = false;  // options say by which route
  std::string text;
};

// Throws UsageError. `is_root` decides the default daemon.
ParsedCommandLine parse_command_line(const std::vector<std::string>& arguments, bool is_root);

}  // namespace cie::record
