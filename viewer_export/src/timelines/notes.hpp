// What viewers show of an instance or a publication that is selected: the same, by the same names,
// in every format.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/response_time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

namespace cie::viewer_export {

enum class Note : std::uint8_t {
  seq,
  release_source,
  response_time_ns,
  response_time_lower_ns,
  response_time_upper_ns,
  start_latency_ns,
  missed,
  status,
  state,
  cpu_start,
  cpu_end,
  execution_ns,
  preempted_ns,
  blocked_ns,
  wake_delay_ns,
  publisher_id,
  writer_gid,
  source_timestamp_realtime_ns,
  rule,
  subject,
  verdict,
  demands,
  found,
  evidence,
  event,
  cpu,
  pid,
  tid,
  suppression,
  logical_id
};
inline constexpr auto kNotes = static_cast<std::size_t>(Note::logical_id) + 1;

// The note's name, as the enumeration has it.
std::string_view label(Note note) noexcept;

// "complete", "open", "cut by window".
std::string_view label(analysis::InstanceState state) noexcept;

// Which bound of the response time "end - release" is (definitions: "Missing release").
Note response_note(analysis::ReleaseSource source) noexcept;

// What the time from the instance's release, or from what bounds it, to its start is; empty: nothing
// but the start is known.
std::string_view wait_words(analysis::ReleaseSource source) noexcept;

// Calls visit(Note, value) for what is known; values are std::int64_t, std::uint64_t and
// enumerations that have a label().
template <typename Visit>
void visit_notes(const analysis::Instance& i, const Visit& visit) {
  const auto visit_time = [&visit](Note note, const std::optional<analysis::Duration>& time) {
    if (time) visit(note, time->ns);
  };
  visit(Note::seq, i.seq);
  visit(Note::release_source, i.release_source);
  visit_time(response_note(i.release_source), analysis::response_time(i));
  if (is_known(i.release_source)) {
    visit_time(Note::start_latency_ns, analysis::start_latency(i));
  }
  if (i.missed) visit(Note::missed, std::uint64_t{*i.missed});
  if (i.status) visit(Note::status, *i.status);
  visit(Note::state, i.state);
  if (i.cpu_start) visit(Note::cpu_start, std::int64_t{*i.cpu_start});
  if (i.cpu_end) visit(Note::cpu_end, std::int64_t{*i.cpu_end});
  visit_time(Note::execution_ns, i.execution);
  visit_time(Note::preempted_ns, i.preempted);
  visit_time(Note::blocked_ns, i.blocked);
  visit_time(Note::wake_delay_ns, i.wake_delay);
}

template <typename Visit>
void visit_notes(const analysis::Publication& p, const Visit& visit) {
  visit(Note::seq, p.seq);
  visit(Note::publisher_id, std::uint64_t{p.publisher_id});
  visit(Note::writer_gid, p.writer_gid);
  visit(Note::source_timestamp_realtime_ns,
        std::max<std::int64_t>(p.source_timestamp_realtime_ns, 0));
}

// A note's value as number or text.
template <typename T>
auto plain(const T& value) {
  if constexpr (std::is_enum_v<T>) {
    return std::string_view(label(value));
  } else {
    return value;
  }
}

// Notes as members of a JSON object, without its braces. Those that do not fit into a double, as
// JSON's readers have it, are strings.
std::string json_of(const analysis::Instance& instance);
std::string json_of(const analysis::Publication& publication);

}  // namespace cie::viewer_export
