// What a table can be written as.
#pragma once

#include <cstdint>

namespace cie::viewer_export {

// csv: RFC 4180, an empty field for what is not known.
// json_lines: an object per line, null for what is not known.
// parquet: https://parquet.apache.org, Snappy, null for what is not known.
enum class TableFormat : std::uint8_t { csv, json_lines, parquet };

}  // namespace cie::viewer_export
