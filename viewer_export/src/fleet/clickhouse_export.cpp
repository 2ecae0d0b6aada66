#include <cie/viewer_export/fleet_export.hpp>

#include "base/directory.hpp"
#include "clickhouse_files.hpp"
#include "output/result_directory.hpp"
#include "tables/fleet_tables.hpp"
#include "tables/row_binary_table.hpp"

#include <cerrno>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

namespace fs = std::filesystem;

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

std::string type_of(const Column& column) {
  return column.name == "day" ? "Date" : "LowCardinality(String)";
}

// What every server has of its own.
std::string schema() {
  std::string sql =
      R"(-- Tables of recordings, as `cie export --to clickhouse` fills them: viewer_export/docs/fleet.md.
-- A server's own rows. What questions read: single.sql or cluster.sql.
)";
  for (const FleetTable& table : fleet_tables()) {
    sql += fmt::format("\nCREATE TABLE IF NOT EXISTS {}_shard (\n", table.name);
    std::string columns;
    for (const Column& column : kFleetColumns)
      columns += fmt::format("  `{}` {},\n", column.name, type_of(column));
    for (const Column& column : table.columns)
      columns += fmt::format("  `{}` {},\n", column.name, clickhouse_type(table, column));
    columns.erase(columns.size() - 2, 1);
    std::string order = "software";
    for (const std::string_view name : table.order)
      order += fmt::format(", `{}`", name);
    sql += columns +
           fmt::format(") ENGINE = MergeTree PARTITION BY day ORDER BY ({}, host, recording);\n",
                       order);
  }
  return sql;
}

// What questions read, over all servers or one. `whole` makes a table of its shards.
std::string readable(std::string_view comment, std::string_view whole) {
  std::string sql(comment);
  for (const FleetTable& table : fleet_tables()) {
    std::string made(whole);
    replace_all(made, "{table}", table.name);
    sql += "\n" + made;
  }
  // Each recording has the rows that its contents say, or what is asked of them is an error.
  constexpr std::string_view kCheck = R"(
CREATE VIEW IF NOT EXISTS missing_{table} AS
SELECT recording, sum(expected) AS expected_rows, sum(found) AS found_rows
FROM (
  SELECT recording, max(row_count) AS expected, toInt64(0) AS found
  FROM contents WHERE table_name = '{table}' GROUP BY recording
  UNION ALL
  SELECT recording, toInt64(0) AS expected, toInt64(count()) AS found
  FROM {table} GROUP BY recording)
GROUP BY recording
HAVING expected_rows != found_rows;
CREATE VIEW IF NOT EXISTS check_{table} AS
SELECT toUInt8(if(count() = 0, '0', concat('{table} of ', toString(count()), ' recordings are not complete: ',
  toString(any(recording)), ' has ', toString(any(found_rows)), ' rows of ',
  toString(any(expected_rows))))) AS missing
FROM missing_{table};
)";
  for (const FleetTable& table : fleet_tables()) {
    if (table.name == "contents") continue;
    std::string check(kCheck);
    replace_all(check, "{table}", table.name);
    sql += check;
  }
  return sql;
}

class ClickHouseSink final : public FleetSink {
 public:
  ClickHouseSink(fs::path directory, const RecordingIdentity& recording, const OpenFile& open)
      : directory_(std::move(directory)), recording_(recording), open_(open) {}

  void begin(const FleetTable& table) override {
    file_.emplace(open_(directory_ / (table.name + ".rowbinary")));
    table_.emplace(file_->stream(), table, recording_);
    name_ = table.name;
    rows_ = 0;
  }
  void row(const RowPlace& place, std::span<const Cell> cells) override {
    table_->row(place, cells);
    ++rows_;
  }
  void end() override {
    table_->finish();
    table_.reset();
    file_->commit();
    file_.reset();
    counts_ += fmt::format("{} {}\n", name_, rows_);
  }

  // A line for each table: its name and the number of its rows.
  const std::string& counts() const noexcept { return counts_; }

 private:
  fs::path directory_;
  const RecordingIdentity& recording_;
  const OpenFile& open_;
  std::optional<OutputFile> file_;
  std::optional<RowBinaryTable> table_;
  std::string name_;
  std::uint64_t rows_ = 0;
  std::string counts_;
};

// The directory of the result. Where it is new and the result is not complete in the end, it is removed
// with what is in it, and so are those above that were made for it.
class ResultDirectory {
 public:
  // Throws WriteError.
  explicit ResultDirectory(const fs::path& directory) {
    std::error_code unknown;
    for (auto each = directory; !each.empty() && !fs::exists(each, unknown);
         each = each.parent_path())
      made_.push_back(each);
    try {
      directory_.emplace(make_result_directory(directory));
      if (!directory_->is_new()) keep();  // somebody else made it meanwhile
    } catch (...) {
      discard();
      throw;
    }
  }
  ~ResultDirectory() { discard(); }
  ResultDirectory(const ResultDirectory&) = delete;
  ResultDirectory& operator=(const ResultDirectory&) = delete;

  void keep() noexcept { made_.clear(); }
  const Directory& directory() const { return *directory_; }

 private:
  void discard() noexcept {
    std::error_code error;
    for (std::size_t i = 0; i < made_.size(); ++i) {
      if (i == 0) {
        fs::remove_all(made_[i], error);
      } else {
        fs::remove(made_[i], error);  // others may use it by now
      }
    }
    made_.clear();
  }

  std::vector<fs::path> made_;  // the innermost first
  std::optional<Directory> directory_;
};

void write_text(const OpenFile& open, const fs::path& path, std::string_view text) {
  auto file = open(path);
  file.stream() << text;
  file.commit();
}

}  // namespace

void write_clickhouse(const fs::path& directory, const RecordingIdentity& recording,
                      const analysis::AnalysisResult& result, InstanceWriter& instances,
                      const OpenFile& open) {
  constexpr const char* kLoader = "load.sh";
  const fs::path loader = directory / kLoader;
  ResultDirectory whole(directory);
  ResultDirectory data(directory / "data");
  try {
    whole.directory().remove(kLoader);
  } catch (const std::system_error& error) {
    throw WriteError(error.what());
  }
  ClickHouseSink sink(directory / "data", recording, open);
  write_fleet_tables(sink, recording, result, instances);
  write_text(open, directory / "schema.sql", schema());
  write_text(open, directory / "single.sql",
             readable("-- What questions read, on a server that has everything.\n",
                      "CREATE VIEW IF NOT EXISTS {table} AS SELECT * FROM {table}_shard;\n"));
  write_text(
      open, directory / "cluster.sql",
      readable(
          "-- What questions read, on servers that have a part each; load.sh fills in the names.\n",
          "CREATE TABLE IF NOT EXISTS {table} AS {table}_shard "
          "ENGINE = Distributed({cluster}, {database}, {table}_shard);\n"));
  std::string script(kClickHouseLoader);
  replace_all(script, "{{recording}}", recording.id);
  replace_all(script, "{{day}}", day_text(recording));
  replace_all(script, "{{tables}}\n", sink.counts());
  write_text(open, loader, script);
  data.keep();
  whole.keep();
  whole.directory().make_executable(kLoader);
}

}  // namespace cie::viewer_export
