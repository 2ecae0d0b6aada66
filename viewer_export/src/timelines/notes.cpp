#include "notes.hpp"

#include "json/json.hpp"

#include <array>
#include <iterator>
#include <type_traits>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

constexpr std::array<std::string_view, kNotes> kLabels{"seq",
                                                       "release_source",
                                                       "response_time_ns",
                                                       "response_time_lower_ns",
                                                       "response_time_upper_ns",
                                                       "start_latency_ns",
                                                       "missed",
                                                       "status",
                                                       "state",
                                                       "cpu_start",
                                                       "cpu_end",
                                                       "execution_ns",
                                                       "preempted_ns",
                                                       "blocked_ns",
                                                       "wake_delay_ns",
                                                       "publisher_id",
                                                       "writer_gid",
                                                       "source_timestamp_realtime_ns",
                                                       "rule",
                                                       "subject",
                                                       "verdict",
                                                       "demands",
                                                       "found",
                                                       "evidence",
                                                       "event",
                                                       "cpu",
                                                       "pid",
                                                       "tid",
                                                       "suppression",
                                                       "logical_id"};

bool is_wide(Note note) {
  return note == Note::writer_gid || note == Note::source_timestamp_realtime_ns;
}

// Appends members to `text`.
auto appender(std::string& text) {
  return [&text](Note note, const auto& value) {
    const auto out = std::back_inserter(text);
    const auto* comma = text.empty() ? "" : ",";
    if constexpr (std::is_enum_v<std::decay_t<decltype(value)>>) {
      fmt::format_to(out, R"({}"{}":{})", comma, label(note), json_string(plain(value)));
    } else if (is_wide(note)) {
      fmt::format_to(out, R"({}"{}":"{}")", comma, label(note), value);
    } else {
      fmt::format_to(out, R"({}"{}":{})", comma, label(note), value);
    }
  };
}

}  // namespace

std::string_view label(Note note) noexcept {
  const auto index = static_cast<std::size_t>(note);
  return index < kLabels.size() ? kLabels[index] : std::string_view();
}

std::string_view label(analysis::InstanceState state) noexcept {
  switch (state) {
    case analysis::InstanceState::complete:
      return "complete";
    case analysis::InstanceState::open:
      return "open";
    case analysis::InstanceState::cut_by_window:
      break;
  }
  return "cut by window";
}

Note response_note(analysis::ReleaseSource source) noexcept {
  switch (source) {
    case analysis::ReleaseSource::exact:
    case analysis::ReleaseSource::timer_grid:
      return Note::response_time_ns;
    case analysis::ReleaseSource::source_timestamp:
      return Note::response_time_upper_ns;
    case analysis::ReleaseSource::wakeup:
    case analysis::ReleaseSource::start:
    case analysis::ReleaseSource::mixed:
      break;
  }
  return Note::response_time_lower_ns;
}

std::string_view wait_words(analysis::ReleaseSource source) noexcept {
  switch (source) {
    case analysis::ReleaseSource::exact:
    case analysis::ReleaseSource::timer_grid:
      return "release to start";
    case analysis::ReleaseSource::wakeup:
      return "wake-up to start";
    case analysis::ReleaseSource::source_timestamp:
      return "source timestamp to start";
    case analysis::ReleaseSource::start:
    case analysis::ReleaseSource::mixed:
      break;
  }
  return {};
}

std::string json_of(const analysis::Instance& instance) {
  std::string text;
  visit_notes(instance, appender(text));
  return text;
}

std::string json_of(const analysis::Publication& publication) {
  std::string text;
  visit_notes(publication, appender(text));
  return text;
}

}  // namespace cie::viewer_export
