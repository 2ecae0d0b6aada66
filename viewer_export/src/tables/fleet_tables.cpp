#include "fleet_tables.hpp"

#include <cie/analysis/report_fields.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/version.hpp>

#include "instance_rows.hpp"
#include "result_tables.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Report;

// Of every table: see viewer_export/docs/fleet.md.
constexpr std::array<std::string_view, 5> kFleetColumns{"day", "software", "host", "process",
                                                        "recording"};

// Rows begin with what the path does not say of the recording.
FleetTable table_of(std::string name, const std::vector<Column>& columns) {
  FleetTable table{.name = std::move(name),
                   .columns = {{"software", ColumnType::text}, {"recording", ColumnType::text}}};
  table.columns.insert(table.columns.end(), columns.begin(), columns.end());
  return table;
}

// Of the result tables' columns: not those that every row has anyway, nor the statistics of
// callbacks, which are a table of their own (a hundred columns are many files for few rows).
bool is_kept(std::string_view table, const Column& column) {
  const auto is_statistic_of = [&](std::string_view quantity) {
    return column.name.starts_with(std::string(quantity) + "_");
  };
  return std::ranges::find(kFleetColumns, column.name) == kFleetColumns.end() &&
         !(table == "callbacks" && std::ranges::any_of(callback_quantities(), is_statistic_of));
}

FleetTable instances_table() {
  auto table = table_of("instances", {});
  std::ranges::copy_if(InstanceRows::columns(), std::back_inserter(table.columns),
                       [](const Column& column) { return is_kept("instances", column); });
  table.columns.push_back({"counted", ColumnType::boolean});
  return table;
}

FleetTable summaries_table() {
  return table_of("summaries", {{"logical_id", ColumnType::text},
                                {"pid"},
                                {"quantity", ColumnType::text},
                                {"count"},
                                {"min"},
                                {"max"},
                                {"sum"},
                                {"mean", ColumnType::real},
                                {"p50"},
                                {"p90"},
                                {"p99"},
                                {"p99_9"}});
}

FleetTable histograms_table() {
  return table_of("histograms", {{"logical_id", ColumnType::text},
                                 {"pid"},
                                 {"quantity", ColumnType::text},
                                 {"value_ns"},
                                 {"count"},
                                 {"min_ns"},
                                 {"max_ns"}});
}

FleetTable recordings_table() {
  return table_of("recordings", {{"begin_ns"},
                                 {"end_ns"},
                                 {"begin_realtime_ns"},
                                 {"clock_offset_ns"},
                                 {"events"},
                                 {"streams"},
                                 {"lost_events"},
                                 {"complete", ColumnType::boolean},
                                 {"hosts", ColumnType::text},
                                 {"tool_version", ColumnType::text}});
}

// Whose the rows are, by the numbers that the report gives.
class Places {
 public:
  explicit Places(const Report& report) {
    if (report.trace.hosts.size() == 1) whole_.host = report.trace.hosts.front();
    std::map<std::pair<analysis::HostIndex, std::int64_t>, std::uint32_t> lives;
    for (const auto& p : report.processes) {
      places_[p.index] = {.host = p.host,
                          .process = p.name.empty() ? fmt::format("pid-{}", p.pid) : p.name,
                          .pid = p.pid,
                          .former = lives[{p.host_index, p.pid}]++};
    }
  }

  const RowPlace& of(std::optional<analysis::ProcessIndex> process) {
    return process ? places_[*process] : whole_;
  }

 private:
  RowPlace whole_;
  std::map<analysis::ProcessIndex, RowPlace> places_;
};

// Counts what it passes on.
class Tables {
 public:
  Tables(PartitionFiles& files, const Report& report) : files_(files), places_(report) {}

  // Calls write(row) with row(process or nothing, cells).
  template <typename Write>
  void table(const FleetTable& described, Write write) {
    files_.begin(described);
    std::uint64_t rows = 0;
    write([&](std::optional<analysis::ProcessIndex> process, std::span<const Cell> cells) {
      files_.row(places_.of(process), cells);
      ++rows;
    });
    files_.end();
    counts_.emplace_back(described.name, rows);
  }

  const std::vector<std::pair<std::string, std::uint64_t>>& counts() const { return counts_; }

 private:
  PartitionFiles& files_;
  Places places_;
  std::vector<std::pair<std::string, std::uint64_t>> counts_;
};

void write_instances(Tables& tables, const FleetTable& table, InstanceWriter& instances,
                     const Report& report) {
  std::vector<std::size_t> kept;
  const auto columns = InstanceRows::columns();
  for (std::size_t i = 0; i < columns.size(); ++i)
    if (is_kept(table.name, columns[i])) kept.push_back(i);
  tables.table(table, [&](const auto& row) {
    std::vector<Cell> cells;
    InstanceRows::drain(
        instances, report,
        [&](std::span<const Cell> known, analysis::ProcessIndex process, bool is_counted) {
          cells.clear();
          for (const auto i : kept)
            cells.push_back(known[i]);
          cells.emplace_back(is_counted);
          row(process, cells);
        });
  });
}

void write_result(Tables& tables, const FleetTable& table, const ResultTable& source,
                  const analysis::AnalysisResult& result) {
  tables.table(table, [&](const auto& row) {
    std::vector<Cell> kept;
    source.rows(result.report, result.verdicts,
                [&](std::span<const Cell> cells, std::optional<analysis::ProcessIndex> process) {
                  kept.clear();
                  for (std::size_t i = 0; i < cells.size(); ++i)
                    if (is_kept(source.name, source.columns[i])) kept.push_back(cells[i]);
                  row(process, kept);
                });
  });
}

// Calls use(callback, pid, name, summary) for all that was measured.
template <typename Use>
void for_each_summary(const Report& report, Use use) {
  const analysis::ReportRows rows(report);
  for (const auto& callback : report.callbacks) {
    const auto use_measured = [&](std::string_view name, const auto& summary) {
      if (summary) use(callback, rows.process_of(callback).pid, name, *summary);
    };
    quantities(use_measured, callback);
  }
}

void write_summaries(Tables& tables, const FleetTable& table, const Report& report) {
  tables.table(table, [&](const auto& row) {
    for_each_summary(
        report, [&](const auto& c, std::int64_t pid, std::string_view quantity, const auto& s) {
          row(c.process, std::array<Cell, 12>{c.logical_id, pid, quantity, s.count, s.min, s.max,
                                              s.sum, s.mean, s.p50, s.p90, s.p99, s.p99_9});
        });
  });
}

void write_histograms(Tables& tables, const FleetTable& table, const Report& report) {
  tables.table(table, [&](const auto& row) {
    for_each_summary(
        report, [&](const auto& c, std::int64_t pid, std::string_view quantity, const auto& s) {
          for (const auto& bucket : s.buckets) {
            row(c.process, std::array<Cell, 7>{c.logical_id, pid, quantity, bucket.value,
                                               bucket.count, s.min, s.max});
          }
        });
  });
}

void write_recording(Tables& tables, const FleetTable& table, const Report& report) {
  const auto& trace = report.trace;
  const std::string hosts = fmt::format("{}", fmt::join(trace.hosts, " "));
  tables.table(table, [&](const auto& row) {
    row(std::nullopt,
        std::array<Cell, 10>{cell(trace.begin), cell(trace.end), cell(trace.begin_realtime_ns),
                             cell(trace.clock_offset_ns), trace.events, trace.streams,
                             cell(trace.lost_events), trace.complete, hosts, tool_version()});
  });
}

const FleetTable& table_called(std::string_view name) {
  return *std::ranges::find(fleet_tables(), name, &FleetTable::name);
}

}  // namespace

const std::vector<FleetTable>& fleet_tables() {
  static const std::vector<FleetTable> tables = [] {
    std::vector<FleetTable> all{instances_table(), summaries_table(), histograms_table()};
    for (const ResultTable& source : result_tables()) {
      auto table = table_of(source.name, {});
      std::ranges::copy_if(source.columns, std::back_inserter(table.columns),
                           [&](const Column& column) { return is_kept(source.name, column); });
      all.push_back(std::move(table));
    }
    all.push_back(recordings_table());
    all.push_back(table_of("labels", {{"name", ColumnType::text}, {"value", ColumnType::text}}));
    all.push_back(table_of("contents", {{"table_name", ColumnType::text}, {"row_count"}}));
    return all;
  }();
  return tables;
}

void write_fleet_tables(PartitionFiles& files, const RecordingIdentity& recording,
                        const analysis::AnalysisResult& result, InstanceWriter& instances) {
  Tables tables(files, result.report);
  write_instances(tables, table_called("instances"), instances, result.report);
  write_summaries(tables, table_called("summaries"), result.report);
  write_histograms(tables, table_called("histograms"), result.report);
  for (const ResultTable& source : result_tables())
    write_result(tables, table_called(source.name), source, result);
  write_recording(tables, table_called("recordings"), result.report);
  tables.table(table_called("labels"), [&](const auto& row) {
    for (const Label& label : recording.labels)
      row(std::nullopt, std::array<Cell, 2>{label.name, label.value});
  });
  const auto counts = tables.counts();
  tables.table(table_called("contents"), [&](const auto& row) {
    for (const auto& [name, rows] : counts)
      row(std::nullopt, std::array<Cell, 2>{name, rows});
  });
}

}  // namespace cie::viewer_export
