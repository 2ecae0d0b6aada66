#include <cie/viewer_export/instance_writer.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "table_option.hpp"

namespace cie::cli {
namespace {

constexpr const char* kInstancesDescription =
    "Prints one row per instance (one run of a callback), ordered by start, then thread.\n"
    "Times are CLOCK_MONOTONIC in nanoseconds; an empty field is unknown, never zero.";

constexpr const char* kInstancesFooter =
    "Examples:\n"
    "  cie instances recordings/latest -o instances.csv   for a spreadsheet or a database\n"
    "  cie instances run1 --format jsonl | jq .start_ns   one JSON object per line\n"
    "\n"
    "Many instances are sorted on disk: beside FILE, else in TMPDIR or /tmp.\n"
    "Exit codes: 0 done, 2 wrong usage, 4 trace unreadable or result not writable.\n";

}  // namespace

int instances_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::string target = "-";
  std::string format = "csv";
  CommandLine line({"cie instances TRACE... [OPTIONS]", kInstancesDescription, kInstancesFooter});
  line.traces(traces);
  line.option("-f,--format", "FORMAT", format, "csv (default), jsonl (JSON Lines) or parquet");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  const auto table_format = table_format_of("--format", format);
  require_traces(traces);

  auto output = open_output(target);
  if (format == "parquet" && output.is_terminal()) {
    throw UsageError("the result is binary and not for a terminal: name a file with -o FILE");
  }
  viewer_export::InstanceWriter writer(spill_directory(target));
  ProgressBar bar(reader.is_progress_wanted());
  const analysis::AnalysisOptions options{.metadata_from = reader.metadata()};
  const auto& result = analyze_until_exit(traces, options, bar, &writer);
  tell_of_damage(result.report);
  writer.show_progress(begin_writing(bar, output));
  const auto write = [&](std::ostream& out) { writer.write(out, table_format, result.report); };
  write_data(output, write, format == "csv");
  return ok;
}

}  // namespace cie::cli
