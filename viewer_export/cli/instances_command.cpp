#include <cie/viewer_export/instance_writer.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"

namespace cie::cli {
namespace {

constexpr const char* kDescription =
    "Prints one row per instance (one run of a callback), ordered by start, then thread.\n"
    "Times are CLOCK_MONOTONIC in nanoseconds; an empty field is unknown, never zero.";

constexpr const char* kFooter =
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
  CommandLine line({"cie instances TRACE... [OPTIONS]", kDescription, kFooter});
  line.traces(traces);
  line.option("-f,--format", "FORMAT", format, "csv (default) or jsonl (JSON Lines)");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", format, {"csv", "jsonl"}, {"parquet"});
  require_traces(traces);

  auto output = open_output(target);
  viewer_export::InstanceWriter writer(spill_directory(target));
  analyze_with_progress(traces, {.reader = reader.value(), .metadata_from = reader.metadata()},
                        &writer);
  write_data(output, [&](std::ostream& out) {
    writer.write(out, format == "csv" ? viewer_export::InstanceFormat::csv
                                      : viewer_export::InstanceFormat::json_lines);
  });
  return ok;
}

}  // namespace cie::cli
