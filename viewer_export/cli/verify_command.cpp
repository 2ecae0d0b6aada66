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
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

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

// What the command line says of the command itself.
struct VerifyArguments {
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

  bool is_screen() const { return format == "text" && !is_all; }
};

void add_options(CommandLine& line, VerifyArguments& given) {
  line.traces(given.traces);
  line.option("--spec", "FILE", given.spec_file, "Scheduling spec (YAML) to judge by");
  line.option("-f,--format", "FORMAT", given.format, "text (default), json, junit, sarif or tap");
  line.flag("--all", given.is_all,
            "Text: every subject that is violated or undecided, with its evidence");
  line.flag("--ids", given.has_ids, "Text: logical ids in place of short names");
  line.option("-o,--output", "FILE", given.target, "Write to FILE instead of standard output");
  line.option("--inconclusive", "HOW", given.inconclusive_choice,
              "warn: exit 0 when inconclusive, T1 excepted; fail: exit 1");
  line.option("--only", "IDS", given.only, "Judge by these rules alone, for instance M2,M3");
  line.option("--skip", "IDS", given.skip, "Leave these rules out");
  line.flag("--require-lossless", given.options.require_lossless,
            "Any lost event is a violation (T2)");
  line.flag("--check", given.options.is_content_checked,
            "Hold every file of the recording against its SHA-256 in the manifest (T1)");
  line.flag("--allow-crash", given.options.allow_crash,
            "A process that did not end cleanly is no objection (T4)");
  line.option("--explain", "ID", given.explained, "Print the page of a rule, for instance M2");
  line.flag("--list-rules", given.is_listing, "Print all rules");
}

void print_rules(const VerifyArguments& given) {
  auto output = open_output(given.target);
  output.stream() << (given.is_listing ? rule_list()
                                       : rule_page(given.explained, screen_style(output).columns));
  output.commit();
}

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
std::string judging_arguments(const VerifyArguments& given, const SuppressionOption& suppressions) {
  Arguments arguments;
  if (!given.only.empty()) arguments.insert(arguments.end(), {"--only", given.only});
  if (!given.skip.empty()) arguments.insert(arguments.end(), {"--skip", given.skip});
  if (given.options.require_lossless) arguments.emplace_back("--require-lossless");
  if (given.options.is_content_checked) arguments.emplace_back("--check");
  if (given.options.allow_crash) arguments.emplace_back("--allow-crash");
  suppressions.add_to(arguments);
  return arguments.empty() ? std::string() : " " + shell_words(arguments);
}

void write_text(viewer_export::OutputFile& output, const analysis::AnalysisResult& result,
                const viewer_export::VerifyContext& context, const VerifyArguments& given,
                bool is_quiet) {
  auto write = &viewer_export::write_verify_text;
  if (given.is_screen()) {
    write = is_quiet ? &viewer_export::write_verify_line : &viewer_export::write_verify_screen;
  }
  auto style = screen_style(output);
  style.ids = given.has_ids;
  write(output.stream(), result.verdicts, result.report, context, style);
  output.commit();
}

}  // namespace

int verify_command(const Arguments& arguments) {
  VerifyArguments given;
  CommandLine line({"cie verify TRACE... [OPTIONS]", kVerifyDescription, kVerifyFooter});
  add_options(line, given);
  SuppressionOption suppressions(line);
  const WindowOption window(line);
  const ReaderOption reader(line, "One line, and no progress on the terminal");
  if (!line.parse(arguments)) {
    return ok;
  }
  check_choice("--format", given.format, {"text", "json", "junit", "sarif", "tap"});
  const auto policy = on_inconclusive(given.inconclusive_choice);
  const RuleChoice choice(given.only, given.skip);
  if (given.is_listing || !given.explained.empty()) {
    print_rules(given);
    return ok;
  }
  require_traces(given.traces);

  suppressions.read();
  const auto spec = load_spec(given.spec_file);
  auto& options = given.options;
  options.spec = spec ? &*spec : nullptr;
  auto output = open_output(given.target);
  options.metadata_from = reader.metadata();
  window.resolve(given.traces, options);
  ProgressBar bar(reader.is_progress_wanted());
  WorstRuns worst_runs;
  auto& result =
      analyze_until_exit(given.traces, options, bar, given.is_screen() ? &worst_runs : nullptr);
  window.check(result.report, given.traces, options);
  if (options.is_content_checked && result.report.recordings.empty())
    fmt::print(stderr, "cie: --check found no manifest, and held no file against one\n");
  choice.apply(result.verdicts);
  suppressions.apply(result.verdicts);
  if (given.format == "text") {
    viewer_export::VerifyContext context{.spec_name = spec ? spec->name() : std::string{},
                                         .spec_sha256 = spec ? spec->sha256() : std::string{}};
    context.reader_arguments = printable(shell_words(reader.arguments()));
    if (given.is_screen()) {
      context.spec = options.spec;
      context.worst_runs = std::move(worst_runs).take();
      context.view_arguments = printable(input_arguments(given.traces, reader, given.spec_file));
      context.verify_arguments =
          printable(input_arguments(given.traces, reader, given.spec_file, window.text()) +
                    judging_arguments(given, suppressions));
    }
    write_text(output, result, context, given, reader.is_quiet());
  } else {
    write_data(output, [&](std::ostream& out) { write_as(given.format, out, result); });
  }
  return exit_code(result.verdicts, policy);
}

}  // namespace cie::cli
