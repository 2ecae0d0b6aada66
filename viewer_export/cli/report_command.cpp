#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"

namespace cie::cli {
namespace {

constexpr const char* kDescription =
    "Prints what every callback did: response times, start latencies, execution times, missed\n"
    "releases, which thread ran it, and the chains that messages make of callbacks.";

constexpr const char* kFooter =
    R"(Examples:
  cie report recordings/latest                       a table for reading
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
  CommandLine line({"cie report TRACE... [OPTIONS]", kDescription, kFooter});
  line.traces(traces);
  line.option("--spec", "FILE", spec_file, "Scheduling spec (YAML) that names the chains");
  line.option("-f,--format", "FORMAT", format,
              "text (default), json, csv or html (one page for a browser)");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  const WindowOption window(line);
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", format, {"text", "json", "csv", "html"});
  require_traces(traces);

  const auto spec = load_spec(spec_file);
  auto output = open_output(target);
  analysis::AnalysisOptions options{.spec = spec ? &*spec : nullptr,
                                    .metadata_from = reader.metadata(),
                                    .keep_buckets = format == "html"};
  window.resolve(traces, options);
  viewer_export::HtmlReport page;
  ProgressBar bar(reader.is_progress_wanted());
  const auto result =
      analyze_with_progress(traces, options, bar, format == "html" ? &page : nullptr);
  window.check(result.report);
  const auto input = input_arguments(traces, reader, spec_file, window.text());
  if (format == "text") {
    viewer_export::write_report_text(output.stream(), result.report, &result.verdicts,
                                     text_style(output), printable(input));
    output.commit();
  } else if (format == "html") {
    write_data(output,
               [&](std::ostream& out) { page.write(out, result, spec ? &*spec : nullptr, input); });
  } else {
    write_data(output, [&](std::ostream& out) {
      (format == "json" ? viewer_export::write_report_json : viewer_export::write_report_csv)(
          out, result.report);
    });
  }
  return ok;
}

}  // namespace cie::cli
