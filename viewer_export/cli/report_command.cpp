#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"
#include "worst_runs.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

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

// What the command line says of the command itself.
struct ReportArguments {
  std::vector<std::filesystem::path> traces;
  std::string spec_file;
  std::string target = "-";
  std::string format = "text";
  std::string expected;
  bool is_all = false;
  bool has_threads = false;
  bool has_chains = false;
  bool has_ids = false;

  bool is_tables() const { return format == "text" && !is_all && (has_threads || has_chains); }
  bool is_screen() const { return format == "text" && !is_all && !is_tables(); }
  bool is_isolation_expected() const { return expected == "isolated"; }
};

void add_options(CommandLine& line, ReportArguments& given) {
  line.traces(given.traces);
  line.option("--spec", "FILE", given.spec_file, "Scheduling spec (YAML) that names the chains");
  line.option("-f,--format", "FORMAT", given.format,
              "text (default), json, csv or html (one page for a browser)");
  line.option("-o,--output", "FILE", given.target, "Write to FILE instead of standard output");
  line.flag("--all", given.is_all, "Text: everything, callbacks by their logical ids");
  line.flag("--threads", given.has_threads, "Text: the threads, and what each was told to run as");
  line.flag("--chains", given.has_chains, "Text: the chains, hop by hop");
  line.flag("--ids", given.has_ids, "Text: logical ids in place of short names");
  line.option("--expect", "WHAT", given.expected,
              "Text, html: isolated makes shared threads a violation");
}

void write_screen(viewer_export::OutputFile& output, const analysis::AnalysisResult& result,
                  const ReportArguments& given, const viewer_export::TextStyle& style,
                  viewer_export::VerifyContext context) {
  viewer_export::write_report_screen(
      output.stream(), result.report, result.verdicts,
      {.verify = std::move(context), .is_isolation_expected = given.is_isolation_expected()},
      style);
  output.commit();
}

// Everything, or the tables that were asked for.
void write_text(viewer_export::OutputFile& output, const analysis::AnalysisResult& result,
                const ReportArguments& given, const viewer_export::TextStyle& style,
                const std::string& input) {
  const auto& report = result.report;
  if (given.is_all) {
    viewer_export::write_report_text(output.stream(), report, &result.verdicts, style,
                                     printable(input));
  } else {
    if (given.has_threads) viewer_export::write_report_threads(output.stream(), report, style);
    if (given.has_chains) viewer_export::write_report_chains(output.stream(), report, style);
  }
  output.commit();
}

}  // namespace

int report_command(const Arguments& arguments) {
  ReportArguments given;
  CommandLine line({"cie report TRACE... [OPTIONS]", kReportDescription, kReportFooter});
  add_options(line, given);
  const WindowOption window(line);
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", given.format, {"text", "json", "csv", "html"});
  if (!given.expected.empty()) check_choice("--expect", given.expected, {"isolated"});
  require_traces(given.traces);

  const auto spec = load_spec(given.spec_file);
  auto output = open_output(given.target);
  const bool is_html = given.format == "html";
  analysis::AnalysisOptions options{
      .spec = spec ? &*spec : nullptr,
      .metadata_from = reader.metadata(),
      .is_judged = is_html || (given.format == "text" && !given.is_tables()),
      .keep_buckets = is_html};
  window.resolve(given.traces, options);
  viewer_export::HtmlReport page;
  WorstRuns worst_runs;
  analysis::Observer* const observer = is_html ? &page : nullptr;
  ProgressBar bar(reader.is_progress_wanted());
  const auto& result =
      analyze_until_exit(given.traces, options, bar, given.is_screen() ? &worst_runs : observer);
  window.check(result.report, given.traces, options);
  const auto input = input_arguments(given.traces, reader, given.spec_file, window.text());
  auto style = screen_style(output);
  style.ids = given.has_ids;
  if (given.is_screen()) {
    viewer_export::VerifyContext context{
        .spec_name = spec ? spec->name() : std::string{},
        .spec = options.spec,
        .worst_runs = std::move(worst_runs).take(),
        .verify_arguments = printable(input),
        .view_arguments = printable(input_arguments(given.traces, reader, given.spec_file))};
    write_screen(output, result, given, style, std::move(context));
  } else if (given.format == "text") {
    write_text(output, result, given, style, input);
  } else if (is_html) {
    write_data(output, [&](std::ostream& out) {
      page.write(out, result, options.spec, input, given.is_isolation_expected());
    });
  } else {
    const bool is_csv = given.format == "csv";
    if (is_csv) tell_of_damage(result.report);
    const auto write = [&](std::ostream& out) {
      (is_csv ? viewer_export::write_report_csv : viewer_export::write_report_json)(out,
                                                                                    result.report);
    };
    write_data(output, write, is_csv);
  }
  return ok;
}

}  // namespace cie::cli
