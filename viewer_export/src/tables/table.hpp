// Tables, whatever they are written as.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/viewer_export/table_format.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <ostream>
#include <span>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace cie::viewer_export {

enum class ColumnType : std::uint8_t { integer, real, boolean, text };

struct Column {
  std::string_view name;
  ColumnType type = ColumnType::integer;
};

// Empty: not known. Otherwise of its column's type; text is borrowed for the call. Formats that
// have signed integers only store an unsigned one with the same 64 bits.
using Cell =
    std::variant<std::monostate, std::int64_t, std::uint64_t, double, bool, std::string_view>;

// Of a time or a count that the report has unsigned.
inline std::int64_t as_integer(std::uint64_t value) { return analysis::signed_ns(value); }

template <typename T>
Cell cell(const std::optional<T>& value) {
  if (!value) return {};
  if constexpr (std::is_same_v<T, std::string>) {
    return Cell(std::string_view(*value));
  } else if constexpr (std::is_unsigned_v<T>) {
    return Cell(as_integer(*value));
  } else if constexpr (std::is_integral_v<T> || std::is_enum_v<T>) {
    return Cell(static_cast<std::int64_t>(*value));
  } else {
    return Cell(static_cast<std::int64_t>(value->ns));
  }
}

// The number of a row, by which rows are joined.
template <typename Index>
requires std::is_enum_v<Index> Cell index_cell(Index index) {
  return static_cast<std::int64_t>(index);
}

// Takes the rows of one table, in order. Throws what the stream throws.
class TableWriter {
 public:
  virtual ~TableWriter() = default;
  virtual void row(std::span<const Cell> cells) = 0;
  // Call it once, after the last row.
  virtual void finish() = 0;
};

std::unique_ptr<TableWriter> make_csv_table(std::ostream& out, std::span<const Column> columns);
std::unique_ptr<TableWriter> make_json_lines_table(std::ostream& out,
                                                   std::span<const Column> columns);
std::unique_ptr<TableWriter> make_parquet_table(std::ostream& out, std::span<const Column> columns);
std::unique_ptr<TableWriter> make_table(TableFormat format, std::ostream& out,
                                        std::span<const Column> columns);

}  // namespace cie::viewer_export
