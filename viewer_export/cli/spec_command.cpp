#include <cie/tracepoints/scheduling_spec.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "spec_template.hpp"
#include "words/text_layout.hpp"

#include <cstdint>

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr const char* kSpecDescription =
    "Works on scheduling specs: what each callback's thread is meant to run as.\n"
    "ACTION is check: reads the spec FILE as cie run and cie verify do, and says what it holds or\n"
    "where it is wrong; or template: writes a spec from what the trace FILE shows, with what was\n"
    "observed of each callback as comments.";

constexpr const char* kSpecFooter =
    "Examples:\n"
    "  cie spec check app.yaml\n"
    "  cie spec template recordings/latest -o app.yaml\n"
    "\n"
    "Exit codes: 0 done, 2 the spec cannot be used or wrong usage, 4 trace unreadable or result\n"
    "not writable.\n";

// By the defaults: a spec is also checked elsewhere than where it is applied.
bool is_period_refused(const ThreadParameters& parameters) {
  constexpr std::uint64_t kMicrosecond = 1000;
  return parameters.policy == Policy::deadline &&
         (parameters.period_ns < kLeastPeriodUs * kMicrosecond ||
          parameters.period_ns > kMostPeriodUs * kMicrosecond);
}

void check_spec(const std::string& file, const std::string& target) {
  const auto spec = SchedulingSpec::load(file);
  auto output = open_output(target);
  const auto write = [&output, columns = screen_style(output).columns](const std::string& text) {
    constexpr std::size_t kIndent = 2;
    output.stream() << viewer_export::filled(text, columns, kIndent);
  };
  write(fmt::format(
      "{}: good: {}, {}, {}", printable(spec.name()), counted(spec.callbacks().size(), "callback"),
      counted(spec.threads().size(), "thread"), counted(spec.chains().size(), "chain")));
  write("  sha256 " + spec.sha256());
  for (const auto& [section, line] : spec.not_applied()) {
    write(fmt::format("{}:{}: note: \"{}\" is about the machine and is not applied",
                      printable(spec.name()), line, section));
  }
  for (const auto* entries : {&spec.callbacks(), &spec.threads()}) {
    for (const auto& entry : *entries) {
      if (!is_period_refused(entry.parameters)) continue;
      write(fmt::format(
          "{}:{}: note: Linux refuses this SCHED_DEADLINE period unless "
          "kernel.sched_deadline_period_min_us and _max_us were changed: they are {} us and {} us",
          printable(spec.name()), entry.line, kLeastPeriodUs, kMostPeriodUs));
    }
  }
  output.commit();
}

void write_template(const std::string& trace, const std::string& target) {
  auto output = open_output(target);
  ProgressBar bar(true);
  const std::vector<std::filesystem::path> traces{trace};
  const analysis::AnalysisOptions options;
  const auto& result = analyze_until_exit(traces, options, bar);
  tell_of_damage(result.report);
  write_spec_template(output.stream(), result.report);
  output.commit();
}

}  // namespace

int spec_command(const Arguments& arguments) {
  std::string action;
  std::string file;
  std::string target = "-";
  CommandLine line(
      {"cie spec check FILE | template TRACE [-o FILE]", kSpecDescription, kSpecFooter});
  line.argument("ACTION", action, "check or template");
  line.argument("FILE", file, "Scheduling spec (YAML) to check, or trace to write one from");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  if (!line.parse(arguments)) {
    return ok;
  }
  if (action.empty()) {
    throw UsageError("no ACTION was given; available: check, template");
  }
  check_choice("spec", action, {"check", "template"});
  if (action == "check") {
    if (file.empty()) throw UsageError("no FILE was given: name the spec to check");
    check_spec(file, target);
  } else {
    if (file.empty()) {
      throw UsageError("no TRACE was given: name the directory that a recording is in");
    }
    write_template(file, target);
  }
  return ok;
}

}  // namespace cie::cli
