#include <cie/viewer_export/fleet_export.hpp>

#include "fleet_tables.hpp"
#include "output/result_directory.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

std::string duckdb_table(const FleetTable& table) {
  return fmt::format(
      R"(
CREATE OR REPLACE VIEW {0} AS SELECT * FROM read_parquet('{0}/**/*.parquet',
  hive_partitioning = true, hive_types = {{'day': DATE, 'host': VARCHAR, 'process': VARCHAR}}, union_by_name = true);
)",
      table.name);
}

std::string_view clickhouse_type(ColumnType type) {
  switch (type) {
    case ColumnType::integer:
      return "Nullable(Int64)";
    case ColumnType::real:
      return "Nullable(Float64)";
    case ColumnType::boolean:
      return "Nullable(Bool)";
    case ColumnType::text:
      break;
  }
  return "Nullable(String)";
}

// Its own reading of the path takes the host "007" for a number, and leaves %XX as they are.
std::string clickhouse_table(const FleetTable& table) {
  std::string structure;
  for (const Column& column : table.columns) {
    structure += fmt::format("{}`{}` {}", structure.empty() ? "" : ", ", column.name,
                             clickhouse_type(column.type));
  }
  const auto part = [](std::string_view name) {
    return fmt::format("extract(CAST(_path AS String), '.*/{}=([^/]*)/')", name);
  };
  const auto text = [&part](std::string_view name) {
    return fmt::format("nullIf(decodeURLComponent({}), '__HIVE_DEFAULT_PARTITION__') AS {}",
                       part(name), name);
  };
  return fmt::format(R"(
CREATE OR REPLACE VIEW {0} AS SELECT *, toDate({1}) AS day,
  {2},
  {3}
FROM file('{0}/**/*.parquet', 'Parquet', '{4}')
SETTINGS use_hive_partitioning = 0;
)",
                     table.name, part("day"), text("host"), text("process"), structure);
}

// Each recording has the rows that its contents say, or what is asked of them is an error: text that
// is no number.
std::string check(const FleetTable& table) {
  return fmt::format(R"(
CREATE OR REPLACE VIEW missing_{0} AS
SELECT recording, sum(expected) AS expected_rows, sum(found) AS found_rows
FROM (
  SELECT recording, max(row_count) AS expected, 0 AS found
  FROM contents WHERE table_name = '{0}' GROUP BY recording
  UNION ALL
  SELECT recording, 0 AS expected, count(*) AS found FROM {0} GROUP BY recording) AS counted
GROUP BY recording
HAVING sum(expected) <> sum(found);
CREATE OR REPLACE VIEW check_{0} AS
SELECT CAST(CASE WHEN count(*) = 0 THEN '0' ELSE concat('{0} of ', CAST(count(*) AS VARCHAR),
  ' recordings are not complete: ', min(recording)) END AS INTEGER) AS missing
FROM missing_{0};
)",
                     table.name);
}

// Tables of all recordings below a directory.
template <typename Table>
OutputFile views(OutputFile file, std::string_view comment, Table table_of) {
  file.stream() << comment;
  for (const FleetTable& table : fleet_tables())
    file.stream() << table_of(table);
  for (const FleetTable& table : fleet_tables()) {
    if (table.name != "contents") file.stream() << check(table);
  }
  file.stream().flush();
  return file;
}

}  // namespace

void write_partitions(const std::filesystem::path& directory, const RecordingIdentity& recording,
                      const analysis::AnalysisResult& result, InstanceWriter& instances,
                      const OpenFile& open) {
  make_result_directory(directory);
  PartitionFiles files(directory, recording, open);
  write_fleet_tables(files, recording, result, instances);
  std::vector<OutputFile> whole;
  whole.push_back(views(open(directory / "views.sql"),
                        "-- Recordings as `cie export --to parquet --partition` leaves them, for "
                        "DuckDB, read where\n-- it runs: cd DIRECTORY && duckdb -init views.sql\n",
                        duckdb_table));
  whole.push_back(views(open(directory / "views_clickhouse.sql"),
                        "-- Recordings as `cie export --to parquet --partition` leaves them, for "
                        "ClickHouse, read where\n-- it runs: cd DIRECTORY && clickhouse-local. "
                        "Elsewhere: see viewer_export/docs/fleet.md\n",
                        clickhouse_table));
  files.commit(std::move(whole));
}

}  // namespace cie::viewer_export
