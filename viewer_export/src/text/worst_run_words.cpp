#include "worst_run_words.hpp"

#include <cie/analysis/report_rows.hpp>

#include "words/idle_words.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Duration;

constexpr std::int64_t kSmallPart = 20;  // of the whole: what is less is not told

// "instance 140 at +1.466 s" after the recording's begin, which is a time of one host's clock; with a
// window, which begins later, "at +1.466 s of the recording".
std::string title_of(const Judged& judged, const WorstRun& worst) {
  auto text = fmt::format("instance {}", worst.seq);
  const auto* callback = judged.rows.find(worst.callback);
  const auto begin = judged.report.trace.zero();
  if (!begin || callback == nullptr) return text;
  const auto& host = analysis::host_of(judged.report, judged.rows.process_of(*callback));
  const auto since = worst.start + host.shift - *begin;
  return text + fmt::format(" at {}{}{}", since.ns < 0 ? "" : "+", format_duration(since.ns),
                            judged.verdicts.window ? " of the recording" : "");
}

// "preempted by cc1plus"; "preempted, 2.000 ms of it by cc1plus" where others ran instead, too.
std::string preempted_words(const WorstRun& worst) {
  if (worst.preempted_by.empty()) return "preempted";
  const auto by = printable(worst.preempted_by);
  if (worst.preempted_by_time >= *worst.preempted - worst.idle) return "preempted by " + by;
  return fmt::format("preempted, {} of it by {}", format_duration(worst.preempted_by_time.ns), by);
}

std::string idle_words(const Judged& judged, const WorstRun& worst) {
  const auto* callback = judged.rows.find(worst.callback);
  const auto* thread = callback == nullptr ? nullptr : only_thread_of(judged.rows, *callback);
  const bool has_blocked = !worst.blocked || worst.blocked->ns > 0;
  const auto why = why_cpu_was_idle(thread, has_blocked ? std::nullopt : worst.execution);
  return fmt::format("runnable while its CPU was idle ({})", why);
}

// Its release was calculated, and taken back when it had been told: the report has a bound in its place.
bool is_taken_back(const WorstRun& worst, const analysis::CallbackReport& callback) {
  return std::ranges::none_of(
      std::array{&callback.response_time, &callback.response_time_lower, &callback.duration},
      [&worst](const auto* times) { return *times && (*times)->max >= worst.response_time.ns; });
}

}  // namespace

const WorstRun* worst_run_of(const Judged& judged, const analysis::CallbackReport& callback) {
  const auto& all = judged.context.worst_runs;
  const auto found = std::ranges::find(all, callback.index, &WorstRun::callback);
  return found == all.end() || is_taken_back(*found, callback) ? nullptr : &*found;
}

std::string where_time_went(const Judged& judged, const WorstRun& worst) {
  const auto text = title_of(judged, worst);
  const auto response = format_duration(worst.response_time.ns);
  const auto* behind = worst.behind ? judged.rows.find(worst.behind->callback) : nullptr;
  if (behind != nullptr && 2 * worst.behind->time.ns >= worst.response_time.ns) {
    return fmt::format("{}: {}{} of {} behind {}", text,
                       worst.behind->is_at_least ? "at least " : "",
                       format_duration(worst.behind->time.ns), response, judged.names.of(*behind));
  }
  std::vector<std::pair<Duration, std::string>> parts;
  Duration waited{};
  const auto add = [&parts](Duration time, const std::string& what) {
    if (time.ns > 0) parts.emplace_back(time, what);
  };
  const auto add_wait = [&](const std::optional<Duration>& time, const std::string& what) {
    if (!time) return;
    add(*time, what);
    waited = waited + *time;
  };
  add_wait(worst.start_latency, "waiting to start");
  if (worst.preempted) {
    add_wait(worst.idle, idle_words(judged, worst));
    add_wait(*worst.preempted - worst.idle, preempted_words(worst));
  }
  add_wait(worst.blocked, "blocked");
  add_wait(worst.wake_delay, "waiting for a CPU after it was woken");
  if (parts.empty()) return {};
  // Without the kernel's events the rest may be anything.
  if (worst.execution) {
    add(*worst.execution, "executing");
  } else if (worst.start_latency == waited) {
    add(worst.response_time - waited, "from start to end");
  }
  std::ranges::stable_sort(parts, std::ranges::greater{},
                           [](const auto& part) { return part.first.ns; });
  std::string words;
  for (const auto& [time, what] : parts) {
    if (!words.empty() && time.ns < worst.response_time.ns / kSmallPart) break;
    words += fmt::format("{}{} {}", words.empty() ? "" : ", ", format_duration(time.ns), what);
  }
  return fmt::format("{} took {}: {}", text, response, words);
}

}  // namespace cie::viewer_export
