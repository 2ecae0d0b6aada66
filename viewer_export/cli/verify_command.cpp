#include <cie/analysis/suppressions.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "rule_choice.hpp"
#include "rule_pages.hpp"
#include "window_option.hpp"
#include "words/text_layout.hpp"
#include "worst_runs.hpp"

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr const char* kVerifyDescription =
    R"(Judges a trace by rules: does every callback have a thread of its own, did instances overlap,
do the threads run as the spec says? Each verdict is PASS, FAIL, INCONCLUSIVE (the trace does
not show enough, for instance because events were lost) or NOT_APPLICABLE.)";

constexpr const char* kVerifyFooter =
    "Examples:\n"
    "  cie verify recordings/latest                       what is wrong, in one screen\n"
    "  cie verify recordings/latest --all                 every subject, with its evidence\n"
    "  cie verify run1 --spec app.yaml                    also against the scheduling spec\n"
    "  cie verify run1 --format json -o verdict.json      for programs\n"
    "  cie verify run1 --format junit -o verdict.xml      for continuous integration\n"
    "  cie verify run1 --only M2,M3                       one-to-one mapping alone\n"
    "  cie verify run1 --window +2s..                     without the first two seconds\n"
    "  cie verify run1 --suppressions accepted.yaml       known violations do not count\n"
    "  cie verify --explain M2                            what rule M2 means\n"
    "\n"
    "Without --spec, rules that compare with one are not applicable.\n"
    "Exit codes: 0 pass, 1 violation, 2 wrong usage or spec, 3 inconclusive, 4 trace unreadable\n"
    "or result not writable.\n";

// `--suppressions` and the day they are judged on: today's (UTC) unless `--now` names another.
class SuppressionOption {
 public:
  explicit SuppressionOption(CommandLine& line) {
    line.option("--suppressions", "FILE", file_,
                "Verdicts that are known and accepted (YAML): told, not counted");
    line.option("--now", "DATE", now_, "The day that suppressions expire by; default: today, UTC");
  }

  // After parsing the command line. Throws UsageError and SpecError.
  void read() {
    if (!now_.empty() && file_.empty()) {
      throw UsageError("--now is the day that suppressions expire by: add --suppressions FILE");
    }
    if (!now_.empty() && !analysis::parse_date(now_)) {
      throw UsageError(fmt::format("--now takes a date such as 2026-12-31, and not \"{}\"", now_));
    }
    if (!file_.empty()) suppressions_ = analysis::Suppressions::load(file_);
  }

  // As they were given, for a command line that judges likewise.
  void add_to(Arguments& arguments) const {
    if (!file_.empty()) arguments.insert(arguments.end(), {"--suppressions", file_});
    if (!now_.empty()) arguments.insert(arguments.end(), {"--now", now_});
  }

  void apply(analysis::VerdictReport& verdicts) const {
    if (!suppressions_) return;
    const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
    suppressions_->apply(verdicts, analysis::parse_date(now_).value_or(analysis::Date(today)));
  }

 private:
  std::string file_;
  std::string now_;
  std::optional<analysis::Suppressions> suppressions_;
};

void write_as(const std::string& format, std::ostream& out,
              const analysis::AnalysisResult& result) {
  if (format == "junit") {
    viewer_export::write_verify_junit(out, result.verdicts, result.report);
  } else if (format == "sarif") {
    viewer_export::write_verify_sarif(out, result.verdicts, result.report);
  } else if (format == "tap") {
    viewer_export::write_verify_tap(out, result.verdicts, result.report);
  } else {
    viewer_export::write_verify_json(out, result.verdicts, result.report);
  }
}

// What else a command line needs to judge likewise; begins with a blank, if there is any.
std::string judging_arguments(const std::string& only, const std::string& skip,
                              const analysis::AnalysisOptions& options,
                              const SuppressionOption& suppressions) {
  Arguments arguments;
  if (!only.empty()) arguments.insert(arguments.end(), {"--only", only});
  if (!skip.empty()) arguments.insert(arguments.end(), {"--skip", skip});
  if (options.require_lossless) arguments.emplace_back("--require-lossless");
  if (options.is_content_checked) arguments.emplace_back("--check");
  if (options.allow_crash) arguments.emplace_back("--allow-crash");
  suppressions.add_to(arguments);
  return arguments.empty() ? std::string() : " " + shell_words(arguments);
}

}  // namespace

int verify_command(const Arguments& arguments) {
  std::vector<std::filesystem::path> traces;
  std::string spec_file;
  std::string target = "-";
  std::string format = "text";
  std::string inconclusive_choice;
  std::string only;
  std::string skip;
  std::string explained;
  bool is_listing = false;
  bool is_all = false;
  bool has_ids = false;
  analysis::AnalysisOptions options;
  CommandLine line({"cie verify TRACE... [OPTIONS]", kVerifyDescription, kVerifyFooter});
  line.traces(traces);
  line.option("--spec", "FILE", spec_file, "Scheduling spec (YAML) to judge by");
  line.option("-f,--format", "FORMAT", format, "text (default), json, junit, sarif or tap");
  line.flag("--all", is_all,
            "Text: every subject that is violated or undecided, with its evidence");
  line.flag("--ids", has_ids, "Text: logical ids in place of short names");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  line.option("--inconclusive", "HOW", inconclusive_choice,
              "warn: exit 0 when inconclusive, T1 excepted; fail: exit 1");
  line.option("--only", "IDS", only, "Judge by these rules alone, for instance M2,M3");
  line.option("--skip", "IDS", skip, "Leave these rules out");
  line.flag("--require-lossless", options.require_lossless, "Any lost event is a violation (T2)");
  line.flag("--check", options.is_content_checked,
            "Hold every file of the recording against its SHA-256 in the manifest (T1)");
  line.flag("--allow-crash", options.allow_crash,
            "A process that did not end cleanly is no objection (T4)");
  line.option("--explain", "ID", explained, "Print the page of a rule, for instance M2");
  line.flag("--list-rules", is_listing, "Print all rules");
  SuppressionOption suppressions(line);
  const WindowOption window(line);
  const ReaderOption reader(line, "One line, and no progress on the terminal");
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", format, {"text", "json", "junit", "sarif", "tap"});
  const auto policy = on_inconclusive(inconclusive_choice);
  const RuleChoice choice(only, skip);
  if (is_listing || !explained.empty()) {
    auto output = open_output(target);
    output.stream() << (is_listing ? rule_list()
                                   : rule_page(explained, screen_style(output).columns));
    output.commit();
    return ok;
  }
  require_traces(traces);

  suppressions.read();
  const auto spec = load_spec(spec_file);
  options.spec = spec ? &*spec : nullptr;
  auto output = open_output(target);
  options.metadata_from = reader.metadata();
  window.resolve(traces, options);
  ProgressBar bar(reader.is_progress_wanted());
  const bool is_screen = format == "text" && !is_all;
  WorstRuns worst_runs;
  auto& result = analyze_until_exit(traces, options, bar, is_screen ? &worst_runs : nullptr);
  window.check(result.report, traces, options);
  choice.apply(result.verdicts);
  suppressions.apply(result.verdicts);
  if (format == "text") {
    viewer_export::VerifyContext context{.spec_name = spec ? spec->name() : std::string{},
                                         .spec_sha256 = spec ? spec->sha256() : std::string{}};
    context.reader_arguments = printable(shell_words(reader.arguments()));
    auto write = &viewer_export::write_verify_text;
    if (is_screen) {
      context.spec = options.spec;
      context.worst_runs = std::move(worst_runs).take();
      context.view_arguments = printable(input_arguments(traces, reader, spec_file));
      context.verify_arguments =
          printable(input_arguments(traces, reader, spec_file, window.text()) +
                    judging_arguments(only, skip, options, suppressions));
      write = reader.is_quiet() ? &viewer_export::write_verify_line
                                : &viewer_export::write_verify_screen;
    }
    auto style = screen_style(output);
    style.ids = has_ids;
    write(output.stream(), result.verdicts, result.report, context, style);
    output.commit();
  } else {
    write_data(output, [&](std::ostream& out) { write_as(format, out, result); });
  }
  return exit_code(result.verdicts, policy);
}

}  // namespace cie::cli
