// Recordings of many machines as one tree of Parquet files.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/instance_writer.hpp>
#include <cie/viewer_export/output_file.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// What somebody says about a recording. "software" is the version of the software that ran, "day"
// the day of the recording; other names are the user's.
struct Label {
  std::string name;
  std::string value;
};
// Throws std::invalid_argument with a reason: no "=", no name, or no date after "day=".
Label label_of(std::string_view text);

// What tells one recording from all others.
struct RecordingIdentity {
  // 32 hexadecimal digits that depend on the recording alone (hosts, boots, processes, window), not
  // on its labels or place: the same whoever exports it.
  std::string id;
  // On which it began, days since 1970-01-01, UTC. Empty: neither recording nor label says.
  std::optional<std::int32_t> day;
  std::string software;  // empty: not said
  std::vector<Label> labels;
};
RecordingIdentity identify(const analysis::Report& report, std::vector<Label> labels);
// "2026-11-20"; "1970-01-01" if it is not known.
std::string day_text(const RecordingIdentity& recording);

// How files are made, one after the other.
using OpenFile = std::function<OutputFile(const std::filesystem::path&)>;

// TABLE/day=DAY/host=HOST/process=PROCESS/RECORDING[-PID].parquet below a directory that many
// recordings share, and views.sql and views_clickhouse.sql, which make tables of them in DuckDB and
// ClickHouse. They appear when all are written, in place of those that are there; until then they are
// open. The result was analysed with keep_buckets; `instances` saw it, in the order by_process, and is
// empty afterwards. Throws WriteError.
void write_partitions(const std::filesystem::path& directory, const RecordingIdentity& recording,
                      const analysis::AnalysisResult& result, InstanceWriter& instances,
                      const OpenFile& open);

// `text` as a part of a path: letters, digits, "-", "_" and "." stay, other bytes become %XX, as
// Hive and its readers have it. Longer than a file system takes: cut, with a digest of the whole.
// Empty: "__HIVE_DEFAULT_PARTITION__", which is read as NULL.
std::string partition_value(std::string_view text);

}  // namespace cie::viewer_export
