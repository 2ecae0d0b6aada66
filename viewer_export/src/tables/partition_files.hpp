// Rows of a recording's tables as Parquet files, one for each place.
#pragma once

#include <cie/viewer_export/fleet_export.hpp>
#include <cie/viewer_export/output_file.hpp>

#include "table.hpp"

#include <compare>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace cie::viewer_export {

// A table of the tree, and its columns beside those that the path says.
struct FleetTable {
  std::string name;
  std::vector<Column> columns;
};

// Whose a row is. Empty text and no pid: of the recording as a whole.
struct RowPlace {
  std::string host;     // empty, too, if the recording has several
  std::string process;  // its name, or "pid-N"
  std::optional<std::int64_t> pid;
  std::uint32_t former = 0;  // how many processes of the recording had the pid before it
  friend auto operator<=>(const RowPlace&, const RowPlace&) = default;
};

// Takes table after table. Throws WriteError.
class PartitionFiles {
 public:
  // `recording` and `open` are borrowed.
  PartitionFiles(std::filesystem::path directory, const RecordingIdentity& recording,
                 const OpenFile& open);

  // `table` is borrowed until end().
  void begin(const FleetTable& table);
  // `cells` follow the table's first two, software and recording. Rows of "instances" come process
  // after process.
  void row(const RowPlace& place, std::span<const Cell> cells);
  void end();

  // All of them take their places at once, after the last one was written: a set that a full disk or
  // a signal cut is none. The descriptors of files without names are what it costs.
  void commit(std::vector<OutputFile> views);

 private:
  // The file of one place, or what will be in it.
  struct Part {
    std::optional<OutputFile> file{};
    std::ostringstream kept{};
    std::unique_ptr<TableWriter> table{};
  };
  Part* find(const RowPlace& place);
  void close(const RowPlace& place, Part& part);
  void close_all();
  OutputFile open_file(const RowPlace& place) const;

  std::filesystem::path directory_;
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

}  // namespace cie::viewer_export
