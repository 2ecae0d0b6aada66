#include <cie/analysis/schedulability.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"
#include "worst_runs.hpp"

#include <utility>

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr const char* kAnalyzeDescription =
    R"(What scheduling theory says of a recording's callbacks. Takes from the recording each callback's
longest execution time, shortest inter-arrival time, priority and CPU, computes the longest
response time that these can lead to (response-time analysis per CPU; SCHED_DEADLINE by
admission and EDF tests), and holds what was observed against it.)";

constexpr const char* kAnalyzeFooter =
    "Examples:\n"
    "  cie analyze schedulability run1                    bounds from what was measured\n"
    "  cie analyze schedulability run1 --spec app.yaml    wcet, min_inter_arrival and\n"
    "                                                     response_deadline from the spec\n"
    "  cie analyze schedulability run1 --all              every callback\n"
    "  cie analyze schedulability run1 -f json -o s.json  for programs\n"
    "\n"
    "Execution times need the kernel's events: cie record --kernel. Formulas: analysis/README.md.\n"
    "Exit codes: 0 done, 1 a deadline is not guaranteed or an observed response time exceeds its\n"
    "bound without explanation, 2 wrong usage or spec, 3 there are deadlines and none could be\n"
    "decided, 4 trace unreadable or result not writable.\n";

}  // namespace

int analyze_command(const Arguments& arguments) {
  std::string subject;
  std::vector<std::filesystem::path> traces;
  std::string spec_file;
  std::string target = "-";
  std::string format = "text";
  bool is_all = false;
  bool has_ids = false;
  CommandLine line(
      {"cie analyze schedulability TRACE... [OPTIONS]", kAnalyzeDescription, kAnalyzeFooter});
  line.argument("WHAT", subject, "schedulability");
  line.traces(traces);
  line.option("--spec", "FILE", spec_file, "Scheduling spec (YAML); what it declares counts");
  line.option("-f,--format", "FORMAT", format, "text (default) or json");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  line.flag("--all", is_all, "Text: every callback, not only what one screen has room for");
  line.flag("--ids", has_ids, "Text: logical ids in place of short names");
  const WindowOption window(line);
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  if (subject.empty()) {
    throw UsageError("say what to analyze: cie analyze schedulability TRACE");
  }
  check_choice("cie analyze", subject, {"schedulability"});
  check_choice("--format", format, {"text", "json"});
  require_traces(traces);

  const auto spec = load_spec(spec_file);
  auto output = open_output(target);
  analysis::AnalysisOptions options{.spec = spec ? &*spec : nullptr,
                                    .metadata_from = reader.metadata()};
  window.resolve(traces, options);
  ProgressBar bar(reader.is_progress_wanted());
  const bool is_screen = format == "text" && !is_all;
  WorstRuns worst_runs;
  const auto& result = analyze_until_exit(traces, options, bar, is_screen ? &worst_runs : nullptr);
  window.check(result.report, traces, options);
  const auto schedulability = analysis::schedulability_of(result.report, options.spec);
  auto style = screen_style(output);
  style.ids = has_ids;
  if (is_screen) {
    viewer_export::write_schedulability_screen(
        output.stream(), schedulability, result.report, result.verdicts,
        {.worst_runs = std::move(worst_runs).take(),
         .verify_arguments = printable(input_arguments(traces, reader, spec_file, window.text())),
         .view_arguments = printable(input_arguments(traces, reader, spec_file))},
        style);
    output.commit();
  } else if (format == "text") {
    viewer_export::write_schedulability_text(output.stream(), schedulability, result.report, style);
    output.commit();
  } else {
    tell_of_damage(result.report);
    write_data(output, [&](std::ostream& out) {
      viewer_export::write_schedulability_json(out, schedulability, result.report);
    });
  }
  if (schedulability.has_finding()) return violation;
  return schedulability.is_undecided() ? inconclusive : ok;
}

}  // namespace cie::cli
