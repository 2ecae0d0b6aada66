#include <cie/tracepoints/sha256.hpp>
#include <cie/viewer_export/fleet_export.hpp>

#include "fleet_tables.hpp"
#include "output/held_signals.hpp"
#include "output/result_directory.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

namespace fs = std::filesystem;

// Columns that the path does not say.
std::vector<Column> columns_of(const FleetTable& table) {
  std::vector<Column> columns{{"software", ColumnType::text}, {"recording", ColumnType::text}};
  columns.insert(columns.end(), table.columns.begin(), table.columns.end());
  return columns;
}

class PartitionSink final : public FleetSink {
 public:
  PartitionSink(fs::path directory, const RecordingIdentity& recording, const OpenFile& open)
      : directory_(std::move(directory)),
        recording_(recording),
        open_(open),
        day_(day_text(recording)) {}

  void begin(const FleetTable& table) override {
    table_ = &table;
    // Instances come process after process, and are many; all else is small and comes mixed.
    is_streamed_ = table.name == "instances";
    has_rows_ = false;
  }

  void row(const RowPlace& place, std::span<const Cell> cells) override {
    auto* part = find(place);
    cells_.assign(
        {Cell(std::string_view(recording_.software)), Cell(std::string_view(recording_.id))});
    cells_.insert(cells_.end(), cells.begin(), cells.end());
    part->table->row(cells_);
  }

  void end() override {
    // Every table has a file, or readers would not know its columns.
    if (!has_rows_) find({});
    close_all();
  }

  // All of them take their places at once, after the last one was written: a set that a full disk or
  // a signal cut is none. The descriptors of files without names are what it costs.
  void commit(OutputFile views) {
    written_.push_back(std::move(views));
    const HeldSignals held;
    for (auto& file : written_)
      file.commit();
    written_.clear();
  }

 private:
  // The file of one place, or what will be in it.
  struct Part {
    std::optional<OutputFile> file{};
    std::ostringstream kept{};
    std::unique_ptr<TableWriter> table{};
  };

  void close_all() {
    for (auto& [place, part] : parts_)
      close(place, part);
    parts_.clear();
    last_ = nullptr;
  }

  Part* find(const RowPlace& place) {
    has_rows_ = true;
    if (last_ != nullptr && *last_ == place) return &parts_.at(place);
    if (is_streamed_) close_all();
    const auto [at, is_new] = parts_.try_emplace(place);
    if (is_new) {
      auto& part = at->second;
      if (is_streamed_) part.file.emplace(open_file(place));
      part.table =
          make_parquet_table(is_streamed_ ? part.file->stream() : part.kept, columns_of(*table_));
    }
    last_ = &at->first;
    return &at->second;
  }

  void close(const RowPlace& place, Part& part) {
    part.table->finish();
    part.table.reset();
    if (!part.file) {
      part.file.emplace(open_file(place));
      part.file->stream() << part.kept.view();
    }
    part.file->stream().flush();
    written_.push_back(std::move(*part.file));
    part.file.reset();
  }

  OutputFile open_file(const RowPlace& place) const {
    const fs::path folder = directory_ / table_->name / ("day=" + day_) /
                            ("host=" + partition_value(place.host)) /
                            ("process=" + partition_value(place.process));
    make_result_directory(folder);
    std::string name = recording_.id;
    if (place.pid) name += fmt::format("-{}", *place.pid);
    if (place.former > 0) name += fmt::format("-{}", place.former + 1);
    return open_(folder / (name + ".parquet"));
  }

  fs::path directory_;
  const RecordingIdentity& recording_;
  const OpenFile& open_;
  std::string day_;
  const FleetTable* table_ = nullptr;
  bool is_streamed_ = false;
  bool has_rows_ = false;
  std::map<RowPlace, Part> parts_;
  const RowPlace* last_ = nullptr;  // a key of parts_
  std::vector<Cell> cells_;
  std::vector<OutputFile> written_;  // whole, and not yet in their places
};

// Tables of all recordings below a directory, and the checks that ClickHouse's have.
std::string duckdb_views() {
  std::string sql =
      "-- Recordings as `cie export --to parquet --partition` leaves them, for DuckDB, read where\n"
      "-- it runs: cd DIRECTORY && duckdb -init views.sql\n";
  for (const FleetTable& table : fleet_tables()) {
    sql += fmt::format(
        R"(
CREATE OR REPLACE VIEW {0} AS SELECT * FROM read_parquet('{0}/**/*.parquet',
  hive_partitioning = true, hive_types = {{'day': DATE, 'host': VARCHAR, 'process': VARCHAR}}, union_by_name = true);
)",
        table.name);
  }
  for (const FleetTable& table : fleet_tables()) {
    if (table.name == "contents") continue;
    sql += fmt::format(R"(
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
SELECT CASE WHEN count(*) = 0 THEN 0 ELSE error('{0} of ' || count(*) || ' recordings are not complete: '
  || min(recording)) END AS missing
FROM missing_{0};
)",
                       table.name);
  }
  return sql;
}

}  // namespace

std::string partition_value(std::string_view text) {
  if (text.empty()) return "__HIVE_DEFAULT_PARTITION__";
  // A name in a directory has 255 bytes at most, and "process=" stands before it.
  constexpr std::size_t kLongest = 230;
  constexpr std::size_t kDigest = 16;
  const bool is_path = text == "." || text == "..";
  std::string value;
  for (const char c : text) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '-' || c == '_' || (c == '.' && !is_path);
    if (is_plain) {
      value += c;
    } else {
      value += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  if (value.size() <= kLongest) return value;
  value.resize(kLongest - kDigest - 1);
  if (const auto percent = value.find('%', value.size() - 2); percent != std::string::npos)
    value.resize(percent);  // no half of an escape
  return value + "~" + sha256_hex(text).substr(0, kDigest);
}

void write_partitions(const fs::path& directory, const RecordingIdentity& recording,
                      const analysis::AnalysisResult& result, InstanceWriter& instances,
                      const OpenFile& open) {
  make_result_directory(directory);
  PartitionSink sink(directory, recording, open);
  write_fleet_tables(sink, recording, result, instances);
  auto views = open(directory / "views.sql");
  views.stream() << duckdb_views();
  views.stream().flush();
  sink.commit(std::move(views));
}

}  // namespace cie::viewer_export
