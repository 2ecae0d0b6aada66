#include <cie/viewer_export/graph_writer.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "export_fleet.hpp"
#include "export_tables.hpp"
#include "export_viewers.hpp"
#include "graphviz.hpp"
#include "inputs.hpp"
#include "output.hpp"

#include <cstdio>
#include <sstream>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::cli {
namespace {

constexpr const char* kDescription =
    "Converts a trace for a viewer. Perfetto shows every thread with its callbacks, the waits "
    "from\n"
    "release to start, arrows from each publish to the callbacks it caused, and what the kernel's\n"
    "scheduler did, when that was recorded. The callback graph shows who takes whose messages,\n"
    "with latencies: in Graphviz's language, or drawn by it. Tables hold every instance and every\n"
    "number of the report, for SQL and data frames: all in an SQLite database (sqlite), or one by\n"
    "one (csv, jsonl, parquet); or those of many machines' recordings together, in ClickHouse or "
    "in\n"
    "Parquet files by day, host and process (--partition). Chrome JSON, speedscope, OTLP "
    "(OpenTelemetry's JSON lines) and "
    "MCAP\n"
    "serve other people's tools.";

constexpr const char* kFooter =
    "Examples:\n"
    "  cie export recordings/latest --to perfetto -o run.pftrace\n"
    "  cie export run1 --to perfetto --gzip -o run1.pftrace.gz      a fifth of the size\n"
    "  cie export run1 --to chrome -o run1.json                     where only JSON is taken\n"
    "  cie export run1 --to speedscope -o run1.speedscope.json      flame graphs of threads\n"
    "  cie export run1 --to otlp -o run1.jsonl                      OpenTelemetry spans\n"
    "  cie export run1 --to mcap -o run1.mcap                       Foxglove, PlotJuggler\n"
    "  cie export run1 --to svg -o graph.svg                        the callback graph\n"
    "  cie export run1 --to dot -o graph.dot                        the same, for Graphviz\n"
    "  cie export run1 --to sqlite -o run1.db                       all tables, for SQL\n"
    "  cie export run1 --to parquet --table edges -o edges.parquet  one table (csv, jsonl too)\n"
    "  cie export run1 --to clickhouse --label software=1.2 -o run1.ch; run1.ch/load.sh\n"
    "  cie export run1 --to parquet --partition -o fleet            beside other recordings there\n"
    "\n"
    "Open a Perfetto file at https://ui.perfetto.dev (it stays in your browser) or with "
    "trace_processor.\n"
    "Exit codes: 0 done, 2 wrong usage, 4 trace unreadable or result not writable.\n";

int export_graph(const std::vector<std::filesystem::path>& traces,
                 const analysis::AnalysisOptions& options, ProgressBar& bar, bool is_drawn,
                 const std::string& target) {
  auto output = open_output(target);
  const auto result = analyze_with_progress(traces, options, bar);
  std::ostringstream dot;
  viewer_export::write_graph_dot(dot, result.report);
  const auto graph = is_drawn ? svg_of(dot.str()) : dot.str();
  write_data(output, [&graph](std::ostream& out) { out << graph; });
  return ok;
}

}  // namespace

int export_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::string viewer;
  std::string target = "-";
  std::string table;
  std::string spec_file;
  bool is_compressed = false;
  bool is_partitioned = false;
  std::vector<std::string> labels;
  CommandLine line({"cie export TRACE... --to VIEWER -o FILE [OPTIONS]", kDescription, kFooter});
  line.traces(traces);
  line.option("--to", "VIEWER", viewer,
              "perfetto, chrome, speedscope, otlp, mcap; dot, svg; tables: sqlite, csv, jsonl, "
              "parquet, clickhouse");
  line.option("--table", "NAME", table, "With csv, jsonl, parquet: the table (default: instances)");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  line.flag("--gzip", is_compressed, "Compress the file");
  line.flag("--partition", is_partitioned,
            "With parquet: all tables, in directories by day, host and process below that of -o");
  line.option("--label", "NAME=VALUE", labels,
              "With clickhouse and --partition: a label of the recording; may be repeated. "
              "software=VERSION is what regressions are told by, day=YYYY-MM-DD replaces the day");
  line.option("--spec", "FILE", spec_file, "Scheduling spec (YAML) to judge the violations by");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  if (viewer.empty()) {
    throw UsageError("--to is missing: name the viewer, for instance --to perfetto");
  }
  check_choice("--to", viewer,
               {"perfetto", "chrome", "speedscope", "otlp", "mcap", "dot", "svg", "sqlite", "csv",
                "jsonl", "parquet", "clickhouse"});
  require_traces(traces);
  const auto spec = load_spec(spec_file);
  const analysis::AnalysisOptions options{.spec = spec ? &*spec : nullptr,
                                          .reader = reader.value(),
                                          .metadata_from = reader.metadata()};
  ProgressBar bar(reader.is_progress_wanted());
  const bool is_table = viewer == "csv" || viewer == "jsonl" || viewer == "parquet";
  const bool is_graph = viewer == "dot" || viewer == "svg";
  if (!table.empty() && !is_table) {
    throw UsageError("--table is for --to csv, jsonl and parquet");
  }
  const bool is_fleet = viewer == "clickhouse" || is_partitioned;
  if (is_partitioned && viewer != "parquet") throw UsageError("--partition is for --to parquet");
  if (!labels.empty() && !is_fleet) {
    throw UsageError("--label is for --to clickhouse, and for --to parquet with --partition");
  }
  if (is_fleet) {
    if (is_compressed) throw UsageError("--gzip is for --to perfetto, chrome, speedscope and otlp");
    if (!table.empty()) throw UsageError("--table is not for --partition, which has all tables");
    return export_fleet(traces, options, bar, {.labels = labels, .is_partitioned = is_partitioned},
                        target);
  }
  if (is_table || is_graph || viewer == "sqlite") {
    if (is_compressed) throw UsageError("--gzip is for --to perfetto, chrome, speedscope and otlp");
    if (is_graph) return export_graph(traces, options, bar, viewer == "svg", target);
    if (table.empty()) table = "instances";
    check_table(table);
    return export_tables(traces, options, bar, {.format = viewer, .table = table}, target);
  }
  return export_to_viewer(traces, options, bar,
                          {.viewer = viewer, .target = target, .is_compressed = is_compressed});
}

}  // namespace cie::cli
