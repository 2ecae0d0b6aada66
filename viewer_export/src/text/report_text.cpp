#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include "tables/report_tables.hpp"
#include "words/idle_words.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::Report;
using analysis::Verdict;

constexpr std::size_t kLabelWidth = 11;

// "Window     130.0 ms, …", later lines indented below the first.
std::string labelled(std::string_view label, std::string_view text, const TextStyle& style) {
  std::string result;
  for (const auto& line : wrap(text, style.columns - kLabelWidth)) {
    result += fmt::format("{:<{}}{}\n", result.empty() ? label : "", kLabelWidth, line);
  }
  return result;
}

std::string joined(const std::vector<std::string>& words, std::string_view separator) {
  std::string result;
  for (const auto& word : words) {
    result += result.empty() ? "" : separator;
    result += printable(word);
  }
  return result;
}

// Beyond this many of a kind only the first are named; the JSON has all.
constexpr std::size_t kNamed = 6;

std::string left_out(std::size_t all) {
  return fmt::format("and {} more; --format json has all", all - kNamed);
}

// `window`: what was asked for.
std::string window_text(const Report& report, const std::optional<analysis::TimeWindow>& window) {
  const auto& trace = report.trace;
  auto text =
      window ? fmt::format("only {}..{} ns, ", window->from.ns, window->to.ns) : std::string();
  text += length_of(report, kNamed) + fmt::format(", {} in {}", counted(trace.events, "event"),
                                                  counted(trace.streams, "stream"));
  text += trace.lost_events
              ? fmt::format(", {} reported lost", counted(*trace.lost_events, "event"))
              : fmt::format(", {}", unknown_losses(report));
  if (report.callbacks.empty()) {
    return text;  // nothing that could be complete
  }
  const auto is_whole = is_complete(report);
  if (!is_whole)
    return text + "; whether it is complete is not known: see rules T2 to T4 of cie verify";
  if (*is_whole) return text + "; the recording is complete";
  const bool is_listed = std::ranges::any_of(report.defects, [](const auto& defect) {
    return defect.severity != analysis::Severity::info;
  });
  return text + "; the recording is NOT complete: see " +
         (is_listed ? "the defects below" : "rules T2 to T4 of cie verify");
}

// One line for each, the label before the first.
template <typename Items, typename TextOf>
std::string listed(std::string_view label, const Items& items, const TextStyle& style,
                   const TextOf& text_of) {
  std::string text;
  const auto add = [&](const std::string& item) {
    text += fmt::format("{:<{}}{}\n", text.empty() ? label : "", kLabelWidth,
                        elide(item, style.columns - kLabelWidth));
  };
  for (std::size_t i = 0; i < std::min(items.size(), kNamed); ++i)
    add(text_of(items[i]));
  if (items.size() > kNamed) add(left_out(items.size()));
  return text;
}

// What the recorder wrote down.
std::string said_of_itself(const Report& report, const TextStyle& style) {
  std::string text;
  for (const auto& recording : report.recordings) {
    const auto where = report.recordings.size() > 1 ? printable(recording.path) + ": " : "";
    for (const auto& sentence : sentences_of(recording))
      text += labelled(text.empty() ? "Recording" : "", where + sentence, style);
  }
  return text;
}

std::string recording(const Report& report, const std::optional<analysis::TimeWindow>& window,
                      const TextStyle& style) {
  return listed("Trace", report.trace.paths, style, printable) +
         labelled("Window", window_text(report, window), style) +
         listed("Processes", report.processes, style, process_title) +
         said_of_itself(report, style) + "\n";
}

struct RuleList {
  std::size_t count = 0;
  std::string names;  // with what they are about as long as they are few
};

RuleList rules_with(const analysis::VerdictReport& verdicts, Verdict verdict) {
  constexpr std::size_t kFew = 3;
  std::vector<std::string> ids;
  std::vector<std::string> names;
  for (const auto& rule : verdicts.rules) {
    if (rule.verdict == verdict) {
      ids.push_back(rule.id);
      names.push_back(rule.id + " " + rule.name);
    }
  }
  return {names.size(), names.size() <= kFew ? joined(names, ", ") : joined(ids, " ")};
}

std::string verdict_line(const analysis::VerdictReport& verdicts, std::string_view input,
                         const TextStyle& style) {
  const auto failed = rules_with(verdicts, Verdict::fail);
  const auto open = rules_with(verdicts, Verdict::inconclusive);
  const auto passed = rules_with(verdicts, Verdict::pass);
  std::string text;
  if (failed.count > 0) {
    text = fmt::format("FAIL: {} violated ({})", counted(failed.count, "rule"), failed.names);
  } else if (open.count > 0) {
    text = fmt::format("INCONCLUSIVE: the trace does not decide {} ({})",
                       counted(open.count, "rule"), open.names);
  } else {
    text = fmt::format("PASS: {} checked, none violated", counted(passed.count, "rule"));
  }
  const Look look = failed.count > 0 ? Look::bad : open.count == 0 ? Look::good : Look::doubtful;
  // A command is not broken into lines: a shell would take them for several.
  return paint(labelled("Verdict", text, style), look, style) +
         fmt::format("{:<{}}cie verify {}\n", "Evidence", kLabelWidth, input);
}

// The callback that is worst by `value`; null when nobody has a positive value.
template <typename Value>
const CallbackReport* worst(const Report& report, Value value) {
  const CallbackReport* result = nullptr;
  for (const auto& callback : report.callbacks) {
    if (value(callback) > (result != nullptr ? value(*result) : 0)) {
      result = &callback;
    }
  }
  return result;
}

std::int64_t max_of(const analysis::Rare<analysis::Summary>& summary) {
  return summary ? summary->max : 0;
}

// One line per question that a reader asks first.
std::string worst_offenders(const Report& report, const TextStyle& style) {
  constexpr std::size_t kNames = 37;  // where they begin
  std::string text;
  const auto add = [&](std::string_view question, const std::string& value,
                       const CallbackReport& c) {
    const std::string start = fmt::format("  {:<22}{:>11}  ", question, value);
    text += start + elide(callback_title(report, c), style.columns - start.size()) + "\n";
  };
  const auto response = [](const auto& x) {
    return analysis::longest_response(x).value_or(analysis::LongestResponse{});
  };
  if (const auto* c = worst(report, [&response](const auto& x) { return response(x).ns; })) {
    const auto longest = response(*c);
    add("longest response time", (longest.is_bound ? ">" : "") + format_duration(longest.ns), *c);
  }
  if (const auto* c = worst(report, [](const auto& x) { return max_of(x.start_latency); })) {
    add("longest start latency", format_duration(c->start_latency->max), *c);
  }
  if (const auto* c = worst(report, [](const auto& x) { return max_of(x.preempted); })) {
    add("longest preempted", format_duration(c->preempted->max), *c);
    const auto add_part = [&](std::string_view what, analysis::Duration time,
                              const std::string& by) {
      text += filled(fmt::format("  {:<22}{:>11}  {}", what, format_duration(time.ns), by),
                     style.columns, kNames - 4);
    };
    const auto of_all =
        fmt::format("of {} in all its instances", format_duration(c->preempted->sum));
    if (const auto* by = first_preemptor(c->preempted_by)) {
      const auto name = by->name.empty() ? "?" : printable(by->name);
      add_part("  longest by", by->time, fmt::format("{} (thread {}), {}", name, by->tid, of_all));
    }
    if (const auto idle = idle_time(c->preempted_by); idle.ns > 0) {
      const auto why = why_cpu_was_idle(analysis::ReportRows(report), *c);
      add_part("  its CPU was idle", idle, of_all + ": " + why);
    }
  }
  const auto missed = [](const auto& x) {
    return static_cast<double>(x.missed_releases.value_or(0));
  };
  if (const auto* c = worst(report, missed)) {
    add("most missed releases", fmt::format("{}", *c->missed_releases), *c);
  }
  const auto threw = [](const auto& x) { return static_cast<double>(x.exceptions.value_or(0)); };
  if (const auto* c = worst(report, threw)) {
    add("most exceptions", fmt::format("{}", *c->exceptions), *c);
  }
  const auto waited = [](const auto& x) {
    return static_cast<double>(x.longest_queue.value_or(0));
  };
  if (const auto* c = worst(report, waited); c != nullptr && *c->longest_queue > 1) {
    add("longest queue", counted(*c->longest_queue, "sample"), *c);
  }
  const auto lost = [](const auto& x) { return static_cast<double>(x.lost_samples.value_or(0)); };
  if (const auto* c = worst(report, lost)) {
    add("most lost samples", fmt::format("{}", *c->lost_samples), *c);
  }
  const auto overwritten = [](const auto& x) {
    return static_cast<double>(x.overwritten_samples.value_or(0));
  };
  if (const auto* c = worst(report, overwritten)) {
    add("most overwritten",
        (c->is_overwritten_at_least ? "at least " : "") +
            counted(*c->overwritten_samples, "sample"),
        *c);
  }
  const auto all = static_cast<std::ptrdiff_t>(report.callbacks.size());
  const auto unmapped = callbacks_with(report, analysis::Isolation::never_ran);
  const auto unseen = std::ranges::count_if(report.callbacks, [](const auto& callback) {
    return !callback.has_run() && !callback.never_ran();
  });
  const auto idle = std::ranges::count_if(report.callbacks, &CallbackReport::never_ran);
  if (const auto shared = callbacks_with(report, analysis::Isolation::not_isolated); shared > 0) {
    text += filled(fmt::format("  {:<22}{:>11}  callbacks{} do not have a thread of their own",
                               "not isolated", fmt::format("{} of {}", shared, all - unmapped),
                               unmapped > 0 ? " that ran" : ""),
                   style.columns, kNames - 2);
  }
  for (const auto& [count, what] :
       {std::pair(unseen, "no instance seen"), std::pair(idle, "never ran")}) {
    if (count == 0) continue;
    text += fmt::format("  {:<22}{:>11}  callbacks\n", what, fmt::format("{} of {}", count, all));
  }
  return text.empty() ? text : paint("Worst", Look::strong, style) + "\n" + text + "\n";
}

std::string defects(const Report& report, const TextStyle& style) {
  constexpr std::string_view kIndent = "      ";
  std::string text;
  for (const auto& defect : report.defects) {
    const bool is_error = defect.severity == analysis::Severity::error;
    const bool is_loss = defect.severity == analysis::Severity::loss;
    text += paint(fmt::format("  {} {} x {}\n",
                              is_error  ? "ERROR"
                              : is_loss ? "LOSS "
                                        : "info ",
                              analysis::label(defect.kind), defect.count),
                  is_error  ? Look::bad
                  : is_loss ? Look::doubtful
                            : Look::plain,
                  style);
    for (const auto& line : wrap(printable(defect.advice), style.columns - kIndent.size() - 2)) {
      text += fmt::format("  {}{}\n", kIndent, line);
    }
  }
  return text.empty() ? text
                      : paint("Defects of the trace", Look::strong, style) + "\n" + text + "\n";
}

template <typename Missing>
bool any_callback(const Report& report, Missing missing) {
  return std::any_of(report.callbacks.begin(), report.callbacks.end(),
                     [&](const auto& c) { return c.instances > 0 && missing(c); });
}

std::optional<analysis::Duration> largest_release_error(const Report& report) {
  std::optional<analysis::Duration> largest;
  for (const auto& callback : report.callbacks)
    largest = std::max(largest, callback.release_error);  // an empty one is the least
  return largest;
}

// What the words and the dashes above mean; only what this report needs.
std::string notes(const Report& report, const TextStyle& style) {
  std::vector<std::string> lines{
      "response time = end - release (with waiting behind the previous instance); start latency = "
      "start - release; execution = time on a CPU between start and end. p50 and p99 are within "
      "0.8 %; max is exact where no \">\" marks it."};
  lines.emplace_back("\"-\" means not measured, never zero.");
  if (any_callback(report, [](const auto& c) { return !c.execution_time; })) {
    lines.emplace_back(
        "Execution times need the kernel's scheduler events in the trace (cie record "
        "--kernel=yes).");
  }
  if (any_callback(report,
                   [](const auto& c) { return !c.response_time || c.response_time_lower; })) {
    lines.emplace_back(
        "A response time is \"-\" when no release is known exactly; \">\" marks a lower bound, the "
        "time from the first sign of the instance to its end; \"<\" the upper one, at most, which "
        "begins with the source timestamp of its message. Where some releases are known, p50 and p99 "
        "count the others by their lower bounds.");
  }
  if (const auto error = largest_release_error(report)) {
    lines.emplace_back(
        "Releases of ROS 2's timers follow from when the timer was made: response times and "
        "start latencies of these are up to 10 us too long, and up to " +
        format_duration(error->ns) +
        " if a timer was reset unnoticed. Skipped periods count from the first instance on. A "
        "timer that looks reset, or kept by another clock, has bounds.");
  }
  if (any_callback(report, [](const auto& c) { return !c.missed_releases; })) {
    lines.emplace_back("Missed releases exist for timers only.");
  }
  std::string text = paint("Notes", Look::strong, style) + "\n";
  for (const auto& note : lines) {
    for (const auto& line : wrap(note, style.columns - 2)) {
      text += "  " + line + "\n";
    }
  }
  return text;
}

}  // namespace

void write_report_text(std::ostream& out, const Report& report,
                       const analysis::VerdictReport* verdicts, const TextStyle& given_style,
                       std::string_view input) {
  auto style = given_style;
  style.ids = true;
  if (verdicts != nullptr && !verdicts->rules.empty()) {
    out << verdict_line(*verdicts, input, style) << '\n';
  }
  const auto window = verdicts != nullptr ? verdicts->window : std::nullopt;
  out << worst_offenders(report, style) << recording(report, window, style)
      << defects(report, style);
  if (report.callbacks.empty()) {
    out << filled(no_callback_seen(report), style.columns);
    if (!report.chains.empty()) out << '\n' << chain_tables(report, style);
    return;
  }
  out << callback_tables(report, verdicts, style) << thread_tables(report, style)
      << chain_tables(report, style) << clock_lines(report, style) << notes(report, style);
}

}  // namespace cie::viewer_export
