#include <cie/analysis/comparison.hpp>
#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/diff_writers.hpp>

#include "base/text.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "report_file.hpp"

#include <filesystem>
#include <optional>
#include <string>

namespace cie::cli {
namespace {

constexpr const char* kDiffDescription =
    "Compares two recordings, or reports written by `cie report --format json`: which callbacks\n"
    "became slower by more than a tolerance, and more than chance explains? Callbacks are matched\n"
    "by logical id. Reports keep few quantiles, so comparing recordings decides more.\n"
    "What ran and is gone, or never runs any more, is a regression where the recording after is "
    "complete.";

constexpr const char* kDiffFooter =
    R"(Examples:
  cie diff before after                              what became worse
  cie diff before after --spec app.yaml              also how many runs were late, how late at most
  cie diff before after --tolerance 2                more than 2 % counts
  cie diff before.json after -f json -o diff.json    for programs

Exit codes: 0 no regression, 1 a callback is worse, gone or no longer isolated, or never runs or
never ends, 2 wrong usage or spec, 3 undecided: the instances are too few to decide a single time, a
recording lacks runs, does not prove that a callback is gone, or has none in common with the other,
4 input unreadable or result not writable. More late runs alone are no regression: `cie verify`
judges deadlines.
)";

double tolerance_of(const std::string& text) {
  const auto percent = parse_number<double>(text);
  if (!percent || !(*percent >= 0) || *percent > 1e6) {
    throw UsageError("--tolerance takes a percentage, such as 5, and not \"" + text + '"');
  }
  return *percent / 100;
}

analysis::ComparedSide side_of(const std::filesystem::path& input, const ReaderOption& reader,
                               const std::optional<SchedulingSpec>& spec) {
  if (!std::filesystem::is_directory(input)) {
    if (spec && std::filesystem::exists(input)) {
      throw UsageError("--spec is for recordings: \"" + printable(input.string()) +
                       "\" has the deadlines that it was made with; name the recording");
    }
    return side_in_report(input);
  }
  analysis::SampleCollector collector;
  ProgressBar bar(reader.is_progress_wanted());
  const auto result = analyze_with_progress(
      {input}, {.spec = spec ? &*spec : nullptr, .metadata_from = reader.metadata()}, bar,
      &collector);
  const auto& report = result.report;
  return {.record =
              analysis::ComparedRecord::of(report.trace, report.defects, !report.callbacks.empty()),
          .callbacks = collector.samples(report)};
}

int exit_code_of(const analysis::Comparison& comparison, OnInconclusive on_inconclusive) {
  switch (comparison.outcome()) {
    case analysis::Outcome::no_regression:
      return ok;
    case analysis::Outcome::regression:
      return violation;
    case analysis::Outcome::undecided:
    case analysis::Outcome::nothing_compared:
      break;
  }
  if (on_inconclusive == OnInconclusive::fail) return violation;
  // Where nothing was compared, no warning says enough of it.
  const bool is_waived = on_inconclusive == OnInconclusive::warn && comparison.has_compared();
  return is_waived ? ok : inconclusive;
}

}  // namespace

int diff_command(const Arguments& arguments) {
  std::string before;
  std::string after;
  std::string tolerance = "5";
  std::string format = "text";
  std::string target = "-";
  std::string spec_file;
  std::string inconclusive_choice;
  bool has_ids = false;
  bool is_all = false;
  CommandLine line({"cie diff BEFORE AFTER [OPTIONS]", kDiffDescription, kDiffFooter});
  line.argument("BEFORE", before, "A recording, or a report in JSON");
  line.argument("AFTER", after, "The one to hold against it");
  line.option("--spec", "FILE", spec_file,
              "Scheduling spec (YAML): how many instances of each recording were late");
  line.option("--tolerance", "PERCENT", tolerance, "Growth that does not count (5)");
  line.option("--inconclusive", "HOW", inconclusive_choice,
              "warn: exit 0 when undecided, if anything was compared; fail: exit 1");
  line.option("-f,--format", "FORMAT", format, "text (default) or json");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  line.flag("--all", is_all, "Text: every change, not only those that matter most");
  line.flag("--ids", has_ids, "Text: logical ids in place of short names");
  const ReaderOption reader(line);
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", format, {"text", "json"});
  const auto policy = on_inconclusive(inconclusive_choice);
  if (before.empty() || after.empty()) {
    throw UsageError("two recordings or reports are compared: name both");
  }
  viewer_export::DiffContext context{
      .before = before, .after = after, .tolerance = tolerance_of(tolerance)};
  const auto spec = load_spec(spec_file);
  auto output = open_output(target);
  const auto side_before = side_of(before, reader, spec);
  const auto side_after = side_of(after, reader, spec);
  const auto comparison = analysis::compare(side_before, side_after, context.tolerance);
  if (format == "text") {
    context.isolation_before = viewer_export::isolation_count(side_before.callbacks);
    context.isolation_after = viewer_export::isolation_count(side_after.callbacks);
    context.is_all = is_all;
    context.arguments = printable(input_arguments({before, after}, reader, spec_file));
    if (std::filesystem::is_directory(after))
      context.view_arguments = printable(input_arguments({after}, reader, spec_file));
    auto style = screen_style(output);
    style.ids = has_ids;
    viewer_export::write_diff_text(output.stream(), comparison, context, style);
    output.commit();
  } else {
    write_data(output, [&](std::ostream& out) {
      viewer_export::write_diff_json(out, comparison, context);
    });
  }
  return exit_code_of(comparison, policy);
}

}  // namespace cie::cli
