#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"
#include "worst_runs.hpp"

#include <utility>

namespace cie::cli {
namespace {

constexpr const char* kReportDescription =
    "Prints what callbacks did, the worst first, in one screen: response times, deadlines, chains.\n"
    "With --all: also start latencies, execution times, missed releases, which thread ran what, and\n"
    "the hops of the chains that messages make of callbacks.";

constexpr const char* kReportFooter =
    R"(Examples:
  cie report recordings/latest                       what is worst, in one screen
  cie report recordings/latest --all                 every callback, thread and chain
  cie report run1 --spec app.yaml                    with the chains that the spec names
  cie report run1 --format json -o run1.json         everything, for programs
  cie report run1 --format html -o run1.html         the same with pictures, for a browser
  cie report run1 --window +2s..-1s                  without its first and last seconds
  cie report robot desk                              two recordings of one run, merged by time

Exit codes: 0 done, 2 wrong usage or spec, 4 trace unreadable or result not writable.
)";

}  // namespace

int report_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::string spec_file;
  std::string target = "-";
  std::string format = "text";
  std::string expected;
  bool is_all = false;
  bool has_threads = false;
  bool has_chains = false;
  bool has_ids = false;
  CommandLine line({"cie report TRACE... [OPTIONS]", kReportDescription, kReportFooter});
  line.traces(traces);
  line.option("--spec", "FILE", spec_file, "Scheduling spec (YAML) that names the chains");
  line.option("-f,--format", "FORMAT", format,
              "text (default), json, csv or html (one page for a browser)");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  line.flag("--all", is_all, "Text: everything, callbacks by their logical ids");
  line.flag("--threads", has_threads, "Text: the threads, and what each was told to run as");
  line.flag("--chains", has_chains, "Text: the chains, hop by hop");
  line.flag("--ids", has_ids, "Text: logical ids in place of short names");
  line.option("--expect", "WHAT", expected,
              "Text, html: isolated makes shared threads a violation");
  const WindowOption window(line);
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", format, {"text", "json", "csv", "html"});
  if (!expected.empty()) check_choice("--expect", expected, {"isolated"});
  require_traces(traces);

  const auto spec = load_spec(spec_file);
  auto output = open_output(target);
  const bool is_tables = format == "text" && !is_all && (has_threads || has_chains);
  analysis::AnalysisOptions options{
      .spec = spec ? &*spec : nullptr,
      .metadata_from = reader.metadata(),
      .is_judged = format == "html" || (format == "text" && !is_tables),
      .keep_buckets = format == "html"};
  window.resolve(traces, options);
  viewer_export::HtmlReport page;
  WorstRuns worst_runs;
  const bool is_screen = format == "text" && !is_all && !is_tables;
  analysis::Observer* const observer = format == "html" ? &page : nullptr;
  ProgressBar bar(reader.is_progress_wanted());
  const auto& result = analyze_until_exit(traces, options, bar, is_screen ? &worst_runs : observer);
  window.check(result.report, traces, options);
  const auto input = input_arguments(traces, reader, spec_file, window.text());
  auto style = screen_style(output);
  style.ids = has_ids;
  if (is_screen) {
    viewer_export::write_report_screen(
        output.stream(), result.report, result.verdicts,
        {.verify = {.spec_name = spec ? spec->name() : std::string{},
                    .spec = options.spec,
                    .worst_runs = std::move(worst_runs).take(),
                    .verify_arguments = printable(input),
                    .view_arguments = printable(input_arguments(traces, reader, spec_file))},
         .is_isolation_expected = expected == "isolated"},
        style);
    output.commit();
  } else if (format == "text" && is_all) {
    viewer_export::write_report_text(output.stream(), result.report, &result.verdicts, style,
                                     printable(input));
    output.commit();
  } else if (format == "text") {
    if (has_threads) viewer_export::write_report_threads(output.stream(), result.report, style);
    if (has_chains) viewer_export::write_report_chains(output.stream(), result.report, style);
    output.commit();
  } else if (format == "html") {
    write_data(output, [&](std::ostream& out) {
      page.write(out, result, options.spec, input, expected == "isolated");
    });
  } else {
    if (format == "csv") tell_of_damage(result.report);
    write_data(output, [&](std::ostream& out) {
      (format == "json" ? viewer_export::write_report_json : viewer_export::write_report_csv)(
          out, result.report);
    });
  }
  return ok;
}

}  // namespace cie::cli
