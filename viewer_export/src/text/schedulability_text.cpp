#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/schedulability_writers.hpp>

#include "schedulability_words.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackSchedulability;
using analysis::SchedulabilityReport;

// What callbacks are called: by their ids, with process and host where there are several hosts or a pid had
// several.
class Titles {
 public:
  explicit Titles(const analysis::Report& report)
      : rows_(report), has_several_hosts_(report.trace.hosts.size() > 1) {}

  std::string of(const CallbackSchedulability& callback) const {
    auto id = printable(callback.logical_id);
    const auto& process = rows_.process_of(callback);
    if (!has_several_hosts_ && process.program == 0) return id;
    const auto host = has_several_hosts_ ? " on " + printable(process.host) : std::string();
    return fmt::format("{} ({}{})", id, pid_words(process), host);
  }

 private:
  analysis::ReportRows rows_;
  bool has_several_hosts_;
};

// "MISSED /planner@Timer(1)": all columns beside it fit a screen.
TextCell marked(const CallbackSchedulability& callback, const Titles& titles) {
  const auto mark = standing(callback);
  const auto title = titles.of(callback);
  if (mark.text == kNotMeasured) return {title};
  return {mark.text + ' ' + title, mark.look == Look::good ? Look::plain : mark.look};
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
  for (const auto* row : worst_first(report)) {
    const auto& callback = *row;
    const bool is_above = callback.is_above_bound();
    table.add({marked(callback, titles),
               {policy_of(callback)},
               {format_cpus(callback.cpus)},
               {parameter(callback.execution, format_duration, callback.waiting_ns.value_or(0))},
               {parameter(callback.period, format_duration)},
               {parameter(callback.deadline, format_duration)},
               {time_or_dash(callback.bound_ns, format_duration),
                callback.meets_deadline() == false ? Look::bad : Look::plain},
               {longest_observed(callback, format_duration),
                callback.is_flagged || callback.has_missed_deadline() ? Look::bad
                : is_above                                            ? Look::doubtful
                                                                      : Look::plain}});
  }
  return table.is_empty() ? "no callback was measured\n" : table.render(style);
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

std::string above_the_bound(const SchedulabilityReport& report, const Titles& titles,
                            const TextStyle& style) {
  std::string text;
  for (const auto& callback : report.callbacks) {
    if (!callback.is_above_bound()) continue;
    text += "  " + titles.of(callback) + '\n';
    for (const auto& line : why_above(callback))
      append_wrapped(text, line, style);
    if (!callback.reason.empty())
      append_wrapped(text, "whether its deadline is met is undecided: " + callback.reason, style);
  }
  return titled("Above the bound", text, style);
}

// With the callbacks that each reason concerns.
std::string listed(const std::vector<CommonReason>& reasons, const Titles& titles,
                   const TextStyle& style) {
  std::string text;
  for (const auto& common : reasons) {
    const auto& callbacks = common.callbacks;
    text += filled("  " + counted(callbacks.size(), "callback") + ": " + printable(common.reason()),
                   style.columns, 4);
    for (const auto* callback : callbacks)
      text += "      " + elide(titles.of(*callback), style.columns - 6) + '\n';
  }
  return text;
}

// Of those that are above their bounds it is said there.
std::string undecided_within_bounds(const SchedulabilityReport& report, const Titles& titles,
                                    const TextStyle& style) {
  auto reasons = undecided_by_bound(report, Sameness::equal);
  for (auto& common : reasons) {
    std::erase_if(common.callbacks,
                  [](const auto* callback) { return callback->is_above_bound(); });
  }
  std::erase_if(reasons, [](const CommonReason& common) { return common.callbacks.empty(); });
  return titled("Undecided", listed(reasons, titles, style), style);
}

std::string without_bounds(const SchedulabilityReport& report, const Titles& titles,
                           const TextStyle& style) {
  return titled("Without a bound", listed(without_bound(report, Sameness::equal), titles, style),
                style);
}

std::string demands(const SchedulabilityReport& report, const TextStyle& style) {
  std::string text;
  for (const auto& sentence : processors(report))
    text += filled(sentence, style.columns, 2);
  return text;
}

std::string notes(const SchedulabilityReport& report, const TextStyle& style) {
  auto text =
      '\n' +
      filled(
          "R bounds the response time for these C and T, whatever the phases; \"=\" marks what is "
          "declared, the rest was measured and holds for what this recording saw. C holds the longest "
          "time that an instance was blocked, too, where that was measured. Interrupts and the kernel's own work are not in R: where it was exceeded, a deadline is met if R and "
          "what explains the excess are within it together. "
          "Before a name, MISSED, NO (not guaranteed), ? (undecided) and yes say whether its deadline is met, and "
          "ABOVE R that nothing explains an excess. --format json has all callbacks.",
          style.columns);
  if (report.outside.empty()) return text;
  text += filled("Real-time threads in no bound, because they run no callback:", style.columns);
  for (const auto& name : report.outside)
    text += "  " + printable(name) + '\n';
  return text;
}

// Of a callback: "C of 1 of 8 instances".
std::string measured_in_part(const SchedulabilityReport& report, const Titles& titles,
                             const TextStyle& style) {
  std::string text;
  for (const auto& callback : report.callbacks) {
    const bool is_in_part = callback.runs_measured < callback.runs && callback.execution &&
                            callback.execution->source == analysis::ParameterSource::measured;
    if (!is_in_part) continue;
    text += filled(fmt::format("  {}: C of {} of {}", titles.of(callback), callback.runs_measured,
                               counted(callback.runs, "instance")),
                   style.columns, 4);
  }
  return titled("Measured in part, for holes in the kernel's record", text, style);
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
  const auto why = undecided(report);
  const auto window = measured_window(of);
  out << painted(outcome(report), outcome_look(report), style)
      << (why.empty() ? why : painted(why, Look::doubtful, style))
      << (window.empty() ? window : filled(window, style.columns)) << damages(of, style)
      << above_the_bound(report, titles, style) << undecided_within_bounds(report, titles, style)
      << without_bounds(report, titles, style) << '\n'
      << table(report, titles, style) << measured_in_part(report, titles, style) << '\n'
      << demands(report, style) << notes(report, style);
}

}  // namespace cie::viewer_export
