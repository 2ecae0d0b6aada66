#include <cie/viewer_export/graph_writer.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "export_fleet.hpp"
#include "export_formats.hpp"
#include "export_tables.hpp"
#include "export_viewers.hpp"
#include "graphviz.hpp"
#include "inputs.hpp"
#include "output.hpp"

#include <functional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr const char* kExportDescription =
    R"(Converts a trace for a viewer. Perfetto shows every thread with its callbacks, the waits from
release to start, arrows from each publish to the callbacks it caused, and what the kernel's
scheduler did, when that was recorded. The callback graph shows who takes whose messages,
with latencies: in Graphviz's language, or drawn by it. Tables hold every instance and every
number of the report, for SQL and data frames: all in an SQLite database (sqlite), or one by
one (csv, jsonl, parquet); those of many machines' recordings go into Parquet files by day, host
and process (--partition). Chrome JSON, speedscope, OTLP (OpenTelemetry's JSON lines) and MCAP
serve other people's tools.)";

// Behind an example of each format.
constexpr const char* kExportFooter =
    R"(  cie export run1 --to perfetto --gzip -o run1.pftrace.gz  a fifth of the size
  cie export run1 --to parquet --table edges -o edges.parquet
  cie export run1 --to parquet --partition --label software=1.2 -o fleet

Open a Perfetto file at https://ui.perfetto.dev (it stays in your browser) or with trace_processor.
Exit codes: 0 done, 2 wrong usage or spec, 4 trace unreadable or result not writable.
)";

int export_graph(const std::vector<std::filesystem::path>& traces,
                 const analysis::AnalysisOptions& options, ProgressBar& bar,
                 const ExportFormat& format, const std::string& target) {
  auto output = open_output(target);
  const auto& result = analyze_until_exit(traces, options, bar);
  tell_of_damage(result.report);
  std::ostringstream dot;
  viewer_export::write_graph_dot(dot, result.report);
  const auto graph = format.name == "svg" ? svg_of(dot.str()) : dot.str();
  write_data(output, [&graph](std::ostream& out) { out << graph; });
  return ok;
}

struct Wishes {
  std::vector<std::filesystem::path> traces{};
  std::string viewer{};
  ExportFormat format{};  // of that name
  std::string target = "-";
  std::string table{};
  std::string spec_file{};
  bool is_compressed = false;
  bool is_partitioned = false;
  std::vector<std::string> labels{};
};

void declare(CommandLine& line, Wishes& wishes) {
  line.traces(wishes.traces);
  line.option("--to", "VIEWER", wishes.viewer,
              fmt::format("{}: see below", fmt::join(export_format_names(), ", ")));
  line.option("--table", "NAME", wishes.table,
              "With csv, jsonl, parquet: the table (default: instances)");
  line.option("-o,--output", "FILE", wishes.target, "Write to FILE instead of standard output");
  line.flag("--gzip", wishes.is_compressed, "Compress the file");
  line.flag("--partition", wishes.is_partitioned,
            "With parquet: all tables, by day, host and process below -o");
  line.option("--label", "NAME=VALUE", wishes.labels,
              "Label of a recording of many, for instance software=1.2");
  line.option("--spec", "FILE", wishes.spec_file,
              "Scheduling spec (YAML) to judge the violations by");
}

std::string names_of(const std::function<bool(const ExportFormat&)>& is_wanted) {
  std::vector<std::string_view> names;
  for (const auto& format : export_formats()) {
    if (is_wanted(format)) names.push_back(format.name);
  }
  const auto last = names.back();
  names.pop_back();
  return fmt::format("{} and {}", fmt::join(names, ", "), last);
}

// Finds the format. Throws UsageError for options that do not go together.
void check(Wishes& wishes) {
  if (wishes.viewer.empty()) {
    throw UsageError("--to is missing: name the viewer, for instance --to perfetto");
  }
  wishes.format = export_format(wishes.viewer);
  require_traces(wishes.traces);
  if (wishes.is_partitioned && wishes.viewer != "parquet") {
    throw UsageError("--partition is for --to parquet");
  }
  if (!wishes.labels.empty() && !wishes.is_partitioned) {
    throw UsageError("--label is for --to parquet with --partition");
  }
  if (!wishes.table.empty() && wishes.format.kind != ExportKind::table) {
    throw UsageError("--table is for --to " + names_of([](const ExportFormat& format) {
                       return format.kind == ExportKind::table;
                     }));
  }
  if (!wishes.table.empty() && wishes.is_partitioned) {
    throw UsageError("--table is not for --partition, which has all tables");
  }
  if (!wishes.table.empty()) check_table(wishes.table);
  if (wishes.is_compressed && !wishes.format.is_for_gzip) {
    throw UsageError("--gzip is for --to " +
                     names_of([](const ExportFormat& format) { return format.is_for_gzip; }));
  }
}

}  // namespace

int export_command(const Arguments& arguments) {
  Wishes wishes;
  CommandLine line({"cie export TRACE... --to VIEWER -o FILE [OPTIONS]", kExportDescription,
                    "Examples:\n" + export_examples() + kExportFooter});
  declare(line, wishes);
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check(wishes);
  const auto spec = load_spec(wishes.spec_file);
  const analysis::AnalysisOptions options{.spec = spec ? &*spec : nullptr,
                                          .metadata_from = reader.metadata()};
  ProgressBar bar(reader.is_progress_wanted());
  if (wishes.is_partitioned) {
    return export_fleet(wishes.traces, options, bar, wishes.labels, wishes.target);
  }
  switch (wishes.format.kind) {
    case ExportKind::viewer:
      return export_to_viewer(wishes.traces, options, bar,
                              {.format = wishes.format,
                               .target = wishes.target,
                               .is_compressed = wishes.is_compressed});
    case ExportKind::graph:
      return export_graph(wishes.traces, options, bar, wishes.format, wishes.target);
    case ExportKind::database:
    case ExportKind::table:
      break;
  }
  return export_tables(
      wishes.traces, options, bar,
      {.format = wishes.format, .table = wishes.table.empty() ? "instances" : wishes.table},
      wishes.target);
}

}  // namespace cie::cli
