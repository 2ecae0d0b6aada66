#include "row_binary_table.hpp"

#include <cie/tracepoints/utf8.hpp>

#include "output/binary_numbers.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kWrittenAtOnce = 1U << 16U;  // bytes to write at a time

bool is_required(const FleetTable& table, const Column& column) {
  return std::ranges::find(table.order, column.name) != table.order.end() ||
         std::ranges::find(table.required, column.name) != table.required.end();
}

void put_text(std::string& out, std::string_view text) {
  const std::string valid = is_ascii(text) ? std::string() : valid_utf8(text);
  const std::string_view bytes = valid.empty() ? text : valid;
  append_varint(out, bytes.size());
  out += bytes;
}

}  // namespace

std::string clickhouse_type(const FleetTable& table, const Column& column) {
  const bool is_nullable = !is_required(table, column);
  switch (column.type) {
    case ColumnType::integer:
      return is_nullable ? "Nullable(Int64)" : "Int64";
    case ColumnType::real:
      return is_nullable ? "Nullable(Float64)" : "Float64";
    case ColumnType::boolean:
      return is_nullable ? "Nullable(UInt8)" : "UInt8";
    case ColumnType::text:
      break;
  }
  return is_nullable ? "Nullable(String)" : "LowCardinality(String)";
}

RowBinaryTable::RowBinaryTable(std::ostream& out, const FleetTable& table,
                               const RecordingIdentity& recording)
    : out_(out), recording_(recording) {
  for (const Column& column : table.columns)
    parts_.push_back({.type = column.type, .is_nullable = !is_required(table, column)});
}

void RowBinaryTable::add(const Part& part, const Cell& cell) {
  const bool is_known = !std::holds_alternative<std::monostate>(cell);
  if (part.is_nullable) bytes_ += is_known ? '\0' : '\1';
  if (!is_known && part.is_nullable) return;
  if (part.type == ColumnType::text) {
    put_text(bytes_, is_known ? std::get<std::string_view>(cell) : std::string_view());
  } else if (!is_known) {
    bytes_.append(part.type == ColumnType::boolean ? 1 : 8, '\0');
  } else if (const auto* integer = std::get_if<std::int64_t>(&cell)) {
    append_little_endian(bytes_, *integer);
  } else if (const auto* natural = std::get_if<std::uint64_t>(&cell)) {
    append_little_endian(bytes_, *natural);
  } else if (const auto* real = std::get_if<double>(&cell)) {
    append_little_endian(bytes_, *real);
  } else {
    bytes_ += std::get<bool>(cell) ? '\1' : '\0';
  }
}

void RowBinaryTable::row(const RowPlace& place, std::span<const Cell> cells) {
  if (head_.empty() || place != last_place_) {
    last_place_ = place;
    head_.clear();
    append_little_endian(head_, static_cast<std::uint16_t>(recording_.day.value_or(0)));
    for (const std::string_view part :
         {std::string_view(recording_.software), std::string_view(place.host),
          std::string_view(place.process), std::string_view(recording_.id)})
      put_text(head_, part);
  }
  bytes_ += head_;
  for (std::size_t i = 0; i < cells.size(); ++i)
    add(parts_[i], cells[i]);
  if (bytes_.size() < kWrittenAtOnce) return;
  out_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  bytes_.clear();
}

void RowBinaryTable::finish() {
  out_.write(bytes_.data(), static_cast<std::streamsize>(bytes_.size()));
  bytes_.clear();
}

}  // namespace cie::viewer_export
