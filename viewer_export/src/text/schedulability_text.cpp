#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>

#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackSchedulability;
using analysis::SchedulabilityReport;

std::string time_or_dash(const std::optional<std::int64_t>& ns) {
  return ns ? format_duration(*ns) : "-";
}

// "=" marks what the spec or the callback declares, and nothing else.
std::string parameter(const std::optional<analysis::TaskParameter>& value,
                      std::int64_t measured_besides = 0) {
  if (!value) return "-";
  const bool is_declared =
      value->source == analysis::ParameterSource::declared && measured_besides == 0;
  return (is_declared ? "=" : "") + format_duration(value->ns);
}

// ">" where an instance whose release is not known took longer than those of which it is.
std::string longest_observed(const CallbackSchedulability& callback) {
  const auto& least = callback.observed_at_least_ns;
  const bool is_bound = least && (!callback.observed_ns || *least > *callback.observed_ns);
  return is_bound ? ">" + format_duration(*least) : time_or_dash(callback.observed_ns);
}

// Of it there is nothing to tell but why.
bool is_unmeasured(const CallbackSchedulability& callback) {
  return !callback.execution && !callback.bound_ns && !callback.observed_at_least_ns &&
         !callback.observed_ns;
}

// What callbacks are called: by their ids, with process and host where there are several hosts.
class Titles {
 public:
  explicit Titles(const analysis::Report& report)
      : rows_(report), has_several_hosts_(report.trace.hosts.size() > 1) {}

  std::string of(const CallbackSchedulability& callback) const {
    auto id = printable(callback.logical_id);
    if (!has_several_hosts_) return id;
    const auto& process = rows_.process_of(callback);
    return fmt::format("{} (pid {} on {})", id, process.pid, printable(process.host));
  }

 private:
  analysis::ReportRows rows_;
  bool has_several_hosts_;
};

std::string on_host(const std::string& host) {
  return host.empty() ? std::string() : " on " + printable(host);
}

std::string policy_of(const CallbackSchedulability& callback) {
  if (callback.policy.empty()) return "-";
  const bool has_priority = callback.policy == "SCHED_FIFO" || callback.policy == "SCHED_RR";
  const auto name = callback.policy.substr(callback.policy.find('_') + 1);
  return has_priority ? fmt::format("{} {}", name, callback.priority) : name;
}

std::string table(const SchedulabilityReport& report, const Titles& titles,
                  const TextStyle& style) {
  using Align = TextTable::Align;
  TextTable table({{"callback", "", Align::left},
                   {"policy", "", Align::left},
                   {"CPUs", ""},
                   {"execution", "longest C"},
                   {"inter-arr.", "shortest T"},
                   {"deadline", "D"},
                   {"bound", "R"},
                   {"observed", "longest"}});
  for (const auto& callback : report.callbacks) {
    if (is_unmeasured(callback)) continue;
    const bool misses = callback.meets_deadline() == false;
    const bool is_above = callback.is_above_bound();
    table.add({{titles.of(callback)},
               {policy_of(callback)},
               {format_cpus(callback.cpus)},
               {parameter(callback.execution, callback.waiting_ns.value_or(0))},
               {parameter(callback.period)},
               {parameter(callback.deadline)},
               {time_or_dash(callback.bound_ns), misses ? Look::bad : Look::plain},
               {longest_observed(callback), callback.is_flagged || callback.has_missed_deadline()
                                                ? Look::bad
                                            : is_above ? Look::doubtful
                                                       : Look::plain}});
  }
  return table.is_empty() ? "no callback was measured\n" : table.render(style);
}

// Rounded up: what is demanded, and a whole number of percents otherwise.
std::string percent(std::int64_t ppb) {
  constexpr std::int64_t kHundredth = 100'000;
  const auto hundredths = ppb / kHundredth + (ppb % kHundredth != 0 ? 1 : 0);
  return fmt::format("{}.{:02} %", hundredths / 100, hundredths % 100);
}

// Which CPUs, where others are judged apart from them.
std::string on_cpus(const analysis::DeadlineAdmission& admission,
                    const SchedulabilityReport& report) {
  if (admission.cpus.empty()) return " on unknown CPUs";
  if (report.deadline.size() < 2) return {};
  return fmt::format(" on CPU{} {}", admission.cpus.size() == 1 ? "" : "s",
                     format_cpus(admission.cpus));
}

std::string edf_test(const analysis::DeadlineAdmission& admission) {
  if (!admission.is_guaranteed) return "says nothing, because " + printable(admission.unknown);
  return *admission.is_guaranteed ? "shows that all deadlines are met"
                                  : "does NOT show that deadlines are met";
}

std::string processors(const SchedulabilityReport& report, const TextStyle& style) {
  constexpr std::size_t kIndent = 2;
  std::string text;
  for (const auto& demand : report.cpus) {
    const auto line =
        demand.real_time_ppb
            ? fmt::format("CPU {}{}: real-time callbacks demand up to {}", demand.cpu,
                          on_host(demand.host), percent(*demand.real_time_ppb))
            : fmt::format(
                  "CPU {}{}: what real-time callbacks demand is unknown, because what "
                  "one of them demands is",
                  demand.cpu, on_host(demand.host));
    text += filled(line, style.columns, kIndent);
  }
  for (const auto& admission : report.deadline) {
    const auto line = fmt::format(
        "SCHED_DEADLINE{}{}: {} reserve{} {} of {}; the kernel admits {} by default; the EDF test {}",
        on_cpus(admission, report), on_host(admission.host), counted(admission.servers, "thread"),
        admission.servers == 1 ? "s" : "",
        admission.reserved_ppb ? percent(*admission.reserved_ppb) : "an unknown share",
        counted(admission.processors, "CPU"), percent(admission.admissible_ppb),
        edf_test(admission));
    text += filled(line, style.columns, kIndent);
  }
  return text;
}

void append_wrapped(std::string& text, std::string_view line, const TextStyle& style) {
  constexpr std::string_view kIndent = "      ";
  for (const auto& part : wrap(printable(line), style.columns - kIndent.size()))
    text.append(kIndent).append(part).append("\n");
}

std::string painted(std::string_view text, Look look, const TextStyle& style) {
  std::string result;
  for (const auto& line : wrap(text, style.columns))
    result += paint(line, look, style) + '\n';
  return result;
}

std::string titled(std::string_view title, const std::string& text, const TextStyle& style) {
  return text.empty() ? text : '\n' + painted(title, Look::strong, style) + text;
}

std::vector<std::string> why_above(const CallbackSchedulability& callback) {
  const auto excess = *callback.observed_ns - *callback.bound_ns;
  std::vector<std::string> lines{"observed is " + format_duration(excess) + " above the bound" +
                                 (callback.is_flagged ? ", NOT explained by what is known:" : ":")};
  for (const auto& explanation : callback.explanations)
    lines.push_back("- " + explanation.text);
  if (callback.explanations.empty()) {
    lines.emplace_back("- nothing known accounts for it; look at cie export --to perfetto");
  }
  return lines;
}

std::string above_the_bound(const SchedulabilityReport& report, const Titles& titles,
                            const TextStyle& style) {
  std::string text;
  for (const auto& callback : report.callbacks) {
    if (!callback.is_above_bound()) continue;
    text += "  " + titles.of(callback) + '\n';
    for (const auto& line : why_above(callback))
      append_wrapped(text, line, style);
  }
  return titled("Above the bound", text, style);
}

// Each reason once, the most frequent first, with some of the callbacks that it concerns.
std::string without_bound(const SchedulabilityReport& report, const Titles& titles,
                          const TextStyle& style) {
  constexpr std::size_t kMostNamed = 3;
  using Reason = std::pair<std::string, std::vector<const CallbackSchedulability*>>;
  std::vector<Reason> reasons;
  for (const auto& callback : report.callbacks) {
    if (callback.bound_ns) continue;
    auto found = std::ranges::find(reasons, callback.reason, &Reason::first);
    if (found == reasons.end()) found = reasons.insert(found, {callback.reason, {}});
    found->second.push_back(&callback);
  }
  std::ranges::stable_sort(reasons, std::ranges::greater{},
                           [](const Reason& reason) { return reason.second.size(); });
  std::string text;
  for (const auto& [reason, callbacks] : reasons) {
    text += filled("  " + counted(callbacks.size(), "callback") + ": " + printable(reason),
                   style.columns, 4);
    for (const auto* callback : std::span(callbacks).first(std::min(kMostNamed, callbacks.size())))
      text += "      " + elide(titles.of(*callback), style.columns - 6) + '\n';
    if (callbacks.size() > kMostNamed)
      text += fmt::format("      {} {} more\n", gap(style), callbacks.size() - kMostNamed);
  }
  return titled("Without a bound", text, style);
}

std::string notes(const SchedulabilityReport& report, const TextStyle& style) {
  auto text =
      '\n' +
      filled(
          "R bounds the response time for these C and T, whatever the phases; \"=\" marks what is "
          "declared, the rest was measured and holds for what this recording saw. C holds the longest "
          "time that a run was blocked, too, where that was measured. Interrupts and the kernel's own work are not in R. "
          "--format json has all callbacks.",
          style.columns);
  if (report.outside.empty()) return text;
  text += filled("Real-time threads in no bound, because they run no callback:", style.columns);
  for (const auto& name : report.outside)
    text += "  " + printable(name) + '\n';
  return text;
}

// Of a callback: "C of 1 of 8 runs".
std::string measured_in_part(const SchedulabilityReport& report, const Titles& titles,
                             const TextStyle& style) {
  std::string text;
  for (const auto& callback : report.callbacks) {
    const bool is_in_part = callback.runs_measured < callback.runs && callback.execution &&
                            callback.execution->source == analysis::ParameterSource::measured;
    if (!is_in_part) continue;
    text += filled(fmt::format("  {}: C of {} of {}", titles.of(callback), callback.runs_measured,
                               counted(callback.runs, "run")),
                   style.columns, 4);
  }
  return titled("Measured in part, for holes in the kernel's record", text, style);
}

// Why no deadline is bounded; empty if one is.
std::string undecided(const SchedulabilityReport& report, const TextStyle& style) {
  if (!report.is_undecided()) return {};
  const auto line =
      counted(report.deadlines(), "deadline") + ", none bounded: " + report.why_undecided();
  return painted(printable(line), Look::doubtful, style);
}

// "2 of 28 callbacks have a bound; 3 of 19 deadlines missed, 14 not bounded".
std::string outcome(const SchedulabilityReport& report) {
  const auto count = [&report](const auto& is_so) {
    return static_cast<std::uint64_t>(std::ranges::count_if(report.callbacks, is_so));
  };
  const auto bounded = count([](const auto& callback) { return callback.bound_ns.has_value(); });
  const auto missed = count([](const auto& callback) { return callback.has_missed_deadline(); });
  const auto failed =
      count([](const auto& callback) { return callback.meets_deadline() == false; });
  const auto flagged = count([](const auto& callback) { return callback.is_flagged; });
  auto text =
      fmt::format("{} of {} {} a bound", bounded, counted(report.callbacks.size(), "callback"),
                  bounded == 1 || report.callbacks.size() == 1 ? "has" : "have");
  const auto all = report.deadlines();
  if (all > 0) {
    std::string parts;
    for (const auto& [number, what] :
         {std::pair(missed, "missed"), std::pair(failed - missed, "not guaranteed"),
          std::pair(all - report.decided_deadlines(), "not bounded")}) {
      if (number == 0) continue;
      const auto of = parts.empty() ? fmt::format(" of {}", counted(all, "deadline")) : "";
      parts += fmt::format("{}{}{} {}", parts.empty() ? "" : ", ", number, of, what);
    }
    text += "; " + (parts.empty() ? counted(all, "deadline") + " guaranteed" : parts);
  }
  if (flagged > 0) text += fmt::format("; {} above the bound without explanation", flagged);
  return text;
}

// Which part of the recording C and T are of.
std::string window_of(const analysis::Report& report, const TextStyle& style) {
  const auto window = analysis::asked_window(report.trace);
  return window ? filled("measured in " + window_words(*window), style.columns) : std::string();
}

// What C and T may lack.
std::string damages(const analysis::Report& report, const TextStyle& style) {
  std::string text;
  for (const auto& damage : damages_of(report, gap(style)))
    text += painted(damage, Look::doubtful, style);
  return text;
}

}  // namespace

void write_schedulability_text(std::ostream& out, const SchedulabilityReport& report,
                               const analysis::Report& of, const TextStyle& style) {
  const Titles titles(of);
  out << painted(outcome(report),
                 report.has_finding()    ? Look::bad
                 : report.is_undecided() ? Look::doubtful
                                         : Look::good,
                 style)
      << undecided(report, style) << window_of(of, style) << damages(of, style)
      << above_the_bound(report, titles, style) << without_bound(report, titles, style) << '\n'
      << table(report, titles, style) << measured_in_part(report, titles, style) << '\n'
      << processors(report, style) << notes(report, style);
}

}  // namespace cie::viewer_export
