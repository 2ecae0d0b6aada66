#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>

#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
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

// "=" marks what the spec or the callback declares.
std::string parameter(const std::optional<analysis::TaskParameter>& value) {
  if (!value) return "-";
  const bool is_declared = value->source == analysis::ParameterSource::declared;
  return (is_declared ? "=" : "") + format_duration(value->ns);
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
    const bool misses = callback.meets_deadline() == false;
    const bool is_above = callback.is_above_bound();
    table.add({{titles.of(callback)},
               {policy_of(callback)},
               {format_cpus(callback.cpus)},
               {parameter(callback.execution)},
               {parameter(callback.period)},
               {parameter(callback.deadline)},
               {time_or_dash(callback.bound_ns), misses ? Look::bad : Look::plain},
               {time_or_dash(callback.observed_ns), callback.is_flagged ? Look::bad
                                                    : is_above          ? Look::doubtful
                                                                        : Look::plain}});
  }
  return table.is_empty() ? "no callback was seen\n" : table.render(style);
}

std::string percent(std::int64_t ppb) {
  return fmt::format("{}.{:02} %", ppb / 10'000'000, ppb % 10'000'000 / 100'000);
}

std::string processors(const SchedulabilityReport& report, const TextStyle& style) {
  constexpr std::size_t kIndent = 2;
  std::string text;
  for (const auto& demand : report.cpus) {
    const auto line = demand.real_time_ppb
                          ? fmt::format("CPU {}{}: real-time callbacks demand up to {}", demand.cpu,
                                        on_host(demand.host), percent(*demand.real_time_ppb))
                          : fmt::format(
                                "CPU {}{}: what real-time callbacks demand is unknown, because the "
                                "execution time or the inter-arrival time of one is",
                                demand.cpu, on_host(demand.host));
    text += filled(line, style.columns, kIndent);
  }
  for (const auto& admission : report.deadline) {
    const auto line = fmt::format(
        "SCHED_DEADLINE{}: {} reserve {} of {}; the kernel admits {} by default; the EDF test {}",
        on_host(admission.host), counted(admission.servers, "thread"),
        admission.reserved_ppb ? percent(*admission.reserved_ppb) : "an unknown share",
        counted(admission.processors, "CPU"), percent(admission.admissible_ppb),
        admission.is_guaranteed ? "shows that all deadlines are met"
                                : "does NOT show that deadlines are met");
    text += filled(line, style.columns, kIndent);
  }
  return text;
}

void append_wrapped(std::string& text, std::string_view line, const TextStyle& style) {
  constexpr std::string_view kIndent = "      ";
  for (const auto& part : wrap(printable(line), style.columns - kIndent.size()))
    text.append(kIndent).append(part).append("\n");
}

std::string titled(std::string_view title, const std::string& text, const TextStyle& style) {
  return text.empty() ? text : '\n' + paint(title, Look::strong, style) + '\n' + text;
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

// Each reason once, with the callbacks that it concerns.
std::string without_bound(const SchedulabilityReport& report, const Titles& titles,
                          const TextStyle& style) {
  std::vector<std::pair<std::string, std::string>> reasons;
  for (const auto& callback : report.callbacks) {
    if (callback.bound_ns) continue;
    auto found =
        std::ranges::find(reasons, callback.reason, &std::pair<std::string, std::string>::first);
    if (found == reasons.end()) found = reasons.insert(found, {callback.reason, {}});
    found->second += "  " + titles.of(callback) + '\n';
  }
  std::string text;
  for (const auto& [reason, callbacks] : reasons) {
    text += callbacks;
    append_wrapped(text, reason, style);
  }
  return titled("Without a bound", text, style);
}

std::string notes(const SchedulabilityReport& report, const TextStyle& style) {
  auto text =
      '\n' +
      filled(
          "R bounds the response time for these C and T, whatever the phases; \"=\" marks what is "
          "declared, the rest was measured and holds for what this recording saw. Interrupts and the "
          "kernel's own work are not in it.",
          style.columns);
  if (report.outside.empty()) return text;
  text += "Real-time threads in no bound, because they run no callback:\n";
  for (const auto& name : report.outside)
    text += "  " + printable(name) + '\n';
  return text;
}

std::string painted(const std::string& text, Look look, const TextStyle& style) {
  std::string result;
  for (const auto& line : wrap(text, style.columns))
    result += paint(line, look, style) + '\n';
  return result;
}

// How many deadlines nothing is known of.
std::string undecided(const SchedulabilityReport& report, const TextStyle& style) {
  const auto all = report.deadlines();
  const auto open = all - report.decided_deadlines();
  if (open == 0) return {};
  const auto line =
      open == all
          ? fmt::format("{}, none bounded: {}", counted(all, "deadline"), report.why_undecided())
          : fmt::format("{} of {} not bounded; below is why", open, counted(all, "deadline"));
  return painted(printable(line), Look::doubtful, style);
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
  const auto missing = std::ranges::count_if(
      report.callbacks, [](const auto& callback) { return callback.meets_deadline() == false; });
  const auto flagged = std::ranges::count_if(report.callbacks, &CallbackSchedulability::is_flagged);
  const auto bounded = std::ranges::count_if(
      report.callbacks, [](const auto& callback) { return callback.bound_ns.has_value(); });
  out << painted(fmt::format("{} of {} have a bound; {} not guaranteed; {} above the bound without "
                             "explanation",
                             bounded, counted(report.callbacks.size(), "callback"),
                             counted(static_cast<std::uint64_t>(missing), "deadline"), flagged),
                 report.has_finding()    ? Look::bad
                 : report.is_undecided() ? Look::doubtful
                                         : Look::good,
                 style)
      << undecided(report, style) << damages(of, style) << '\n'
      << table(report, titles, style) << '\n'
      << processors(report, style) << above_the_bound(report, titles, style)
      << without_bound(report, titles, style) << notes(report, style);
}

}  // namespace cie::viewer_export
