// The formats of `cie export --to`, one row each: the command line, its help and what is said on
// the terminal read this table.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::cli {

enum class ExportKind : std::uint8_t {
  viewer,    // a recording for somebody's viewer
  graph,     // of the callbacks
  database,  // of all tables
  table      // one of them
};

struct ExportFormat {
  std::string_view name;
  ExportKind kind{};
  std::string_view suffix;    // of the file in the help's example
  std::string_view purpose;   // what the help says of it
  std::string_view advice{};  // what to do with the file
  bool is_binary = false;     // it is not for a terminal
  bool is_for_gzip = false;   // readers take it compressed
  bool has_messages = false;  // and their publications
};

std::span<const ExportFormat> export_formats();
std::vector<std::string> export_format_names();
// Throws UsageError for a format that there is not.
const ExportFormat& export_format(const std::string& name);

// "  cie export run1 --to chrome -o run1.json    where only JSON is taken", a line of each.
std::string export_examples();

}  // namespace cie::cli
