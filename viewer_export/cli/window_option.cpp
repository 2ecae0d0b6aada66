#include "window_option.hpp"

#include <cie/tracepoints/duration_text.hpp>

#include "words/text_layout.hpp"

#include <cstdint>
#include <limits>
#include <optional>

#include <fmt/format.h>

namespace cie::cli {
namespace {

using analysis::Duration;
using analysis::Timestamp;
using analysis::TimeWindow;

[[noreturn]] void refuse(std::string_view text) {
  throw UsageError(fmt::format(
      "--window does not understand \"{}\"; write FROM..TO, each of them nanoseconds as outputs "
      "show them, +1.5s from the begin, -200ms from the end, or nothing; units are ns, us, ms, s "
      "and min",
      text));
}

// The last or the first time there is in place of what lies beyond it.
Timestamp moved(Timestamp from, Duration by) {
  Timestamp to;
  if (!__builtin_add_overflow(from.ns, by.ns, &to.ns)) return to;
  using Limits = std::numeric_limits<std::int64_t>;
  return {by.ns > 0 ? Limits::max() : Limits::min()};
}

Timestamp resolved(const WindowBound& bound, Timestamp fallback, const TimeWindow& recorded) {
  switch (bound.origin) {
    case WindowBound::Origin::recording:
      return fallback;
    case WindowBound::Origin::clock:
      return Timestamp{} + bound.offset;
    case WindowBound::Origin::begin:
      return moved(recorded.from, bound.offset);
    case WindowBound::Origin::end:
      break;
  }
  return moved(recorded.to, bound.offset);
}

// Without a window.
std::optional<TimeWindow> recorded(const std::vector<std::filesystem::path>& traces,
                                   analysis::AnalysisOptions options) {
  options.window.reset();
  return analysis::recorded_window(traces, options);
}

bool is_relative(const WindowBound& bound) {
  return bound.origin == WindowBound::Origin::begin || bound.origin == WindowBound::Origin::end;
}

}  // namespace

WindowBound parse_window_bound(std::string_view text) {
  if (text.empty()) return {};
  const char sign = text.front();
  if (sign == '+' || sign == '-') {
    const auto ns = parse_duration(text.substr(1));
    if (!ns) refuse(text);
    return sign == '+' ? WindowBound{.origin = WindowBound::Origin::begin, .offset = {*ns}}
                       : WindowBound{.origin = WindowBound::Origin::end, .offset = {-*ns}};
  }
  const auto ns = parse_digits(text);
  if (!ns) refuse(text);
  return {.origin = WindowBound::Origin::clock, .offset = {*ns}};
}

WindowOption::WindowOption(CommandLine& line) {
  line.option("--window", "FROM..TO", text_,
              "Only this part, for instance +1s..-500ms (all forms: man cie-verify, WINDOW)");
}

void WindowOption::resolve(const std::vector<std::filesystem::path>& traces,
                           analysis::AnalysisOptions& options) const {
  if (text_.empty()) return;
  const auto dots = text_.find("..");
  if (dots == std::string::npos) refuse(text_);
  const std::string_view text = text_;
  const auto from = parse_window_bound(text.substr(0, dots));
  const auto to = parse_window_bound(text.substr(dots + 2));
  TimeWindow recorded;
  if (is_relative(from) || is_relative(to)) {
    const auto found = analysis::recorded_window(traces, options);
    if (!found) throw UsageError("--window: the recording has no begin and no end to count from");
    recorded = *found;
  }
  const TimeWindow window{.from = resolved(from, TimeWindow{}.from, recorded),
                          .to = resolved(to, TimeWindow{}.to, recorded)};
  if (window.from > window.to) {
    throw UsageError(fmt::format("--window {} is empty: it begins at {} ns and ends at {} ns",
                                 text_, window.from.ns, window.to.ns));
  }
  options.window = window;
}

void WindowOption::check(const analysis::Report& report,
                         const std::vector<std::filesystem::path>& traces,
                         const analysis::AnalysisOptions& options) const {
  const auto& trace = report.trace;
  if (text_.empty() || !trace.begin || !trace.end || *trace.begin <= *trace.end) return;
  refuse_outside(recorded(traces, options));
}

void WindowOption::check_empty(const std::vector<std::filesystem::path>& traces,
                               const analysis::AnalysisOptions& options) const {
  if (text_.empty() || !options.window) return;
  const auto& window = *options.window;
  const auto all = recorded(traces, options);
  if (all && (window.to < all->from || window.from > all->to)) refuse_outside(all);
}

void WindowOption::refuse_outside(const std::optional<TimeWindow>& recorded) const {
  auto text = fmt::format("--window {} lies outside the recording", text_);
  if (recorded) {
    text += fmt::format(", which is +0s..+{}, {}..{} ns",
                        viewer_export::compact_duration((recorded->to - recorded->from).ns),
                        recorded->from.ns, recorded->to.ns);
  }
  throw UsageError(text);
}

}  // namespace cie::cli
