#include "table_option.hpp"

#include "command_line.hpp"

namespace cie::cli {

viewer_export::TableFormat table_format_of(std::string_view option, const std::string& name) {
  check_choice(option, name, {"csv", "jsonl", "parquet"});
  using enum viewer_export::TableFormat;
  return name == "csv" ? csv : name == "jsonl" ? json_lines : parquet;
}

}  // namespace cie::cli
