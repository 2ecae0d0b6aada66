// The tables of one recording among many: those of every export, with what tells the recordings
// apart before each row, and tables about the recordings themselves.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/fleet_export.hpp>
#include <cie/viewer_export/instance_writer.hpp>

#include "table.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// What every row begins with: see viewer_export/docs/fleet.md.
inline constexpr std::array<Column, 5> kFleetColumns{{{"day", ColumnType::text},
                                                      {"software", ColumnType::text},
                                                      {"host", ColumnType::text},
                                                      {"process", ColumnType::text},
                                                      {"recording", ColumnType::text}}};

struct FleetTable {
  std::string name;
  std::vector<Column> columns;               // that follow kFleetColumns
  std::vector<std::string_view> order;       // those that rows are looked for by; never NULL
  std::vector<std::string_view> required{};  // others that are never NULL
};
// The one called "contents" is the last: how many rows the others have.
const std::vector<FleetTable>& fleet_tables();

// Whose a row is. Empty text and no pid: of the recording as a whole.
struct RowPlace {
  std::string host;     // empty, too, if the recording has several
  std::string process;  // its name, or "pid-N"
  std::optional<std::int64_t> pid;
  std::uint32_t former = 0;  // how many processes of the recording had the pid before it
  friend auto operator<=>(const RowPlace&, const RowPlace&) = default;
};

// Takes table after table. Throws WriteError.
class FleetSink {
 public:
  virtual ~FleetSink() = default;
  virtual void begin(const FleetTable& table) = 0;
  // `cells` are those of the table's columns. Rows of "instances" come process after process.
  virtual void row(const RowPlace& place, std::span<const Cell> cells) = 0;
  virtual void end() = 0;
};

// `instances` has seen the analysis, in the order by_process; it is empty afterwards. The result
// has buckets (AnalysisOptions::keep_buckets). Throws what the sink throws.
void write_fleet_tables(FleetSink& sink, const RecordingIdentity& recording,
                        const analysis::AnalysisResult& result, InstanceWriter& instances);

}  // namespace cie::viewer_export
