// ClickHouse's types, and rows as it reads them fastest among the formats without columns.
#pragma once

#include "fleet_tables.hpp"

#include <cstdint>
#include <ostream>
#include <span>
#include <string>

namespace cie::viewer_export {

// "LowCardinality(String)", "Nullable(Int64)", …: of a column of the table.
std::string clickhouse_type(const FleetTable& table, const Column& column);

// FORMAT RowBinary: https://clickhouse.com/docs/interfaces/formats/RowBinary. Rows of kFleetColumns
// (the day as a Date) and the table's columns. A column that is never NULL takes one as "" or 0.
class RowBinaryTable {
 public:
  // `out` is borrowed.
  RowBinaryTable(std::ostream& out, const FleetTable& table, const RecordingIdentity& recording);

  void row(const RowPlace& place, std::span<const Cell> cells);
  // Call it once, after the last row.
  void finish();

 private:
  struct Part {
    ColumnType type = ColumnType::integer;
    bool is_nullable = false;
  };
  void add(const Part& part, const Cell& cell);

  std::ostream& out_;
  std::vector<Part> parts_;
  RecordingIdentity recording_;
  RowPlace last_place_;
  std::string head_;  // what rows of last_place_ begin with
  std::string bytes_;
};

}  // namespace cie::viewer_export
