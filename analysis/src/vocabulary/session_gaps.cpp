#include "session_gaps.hpp"

#include <algorithm>

namespace cie::analysis {

void SessionGaps::apply(const EventHead& head, const StreamBegin& event) {
  if (event.domain != Domain::user) return;
  auto& trace = traces_[event.trace];
  trace.host = &hosts_[{std::string(event.host), std::string(event.clock_uuid)}];
  ++trace.streams;
  trace.has_callback_events = trace.has_callback_events || event.has_callback_events.value_or(true);
  const auto index = static_cast<std::size_t>(head.stream);
  if (index >= streams_.size()) streams_.resize(index + 1);
  streams_[index] = &trace;
}

std::optional<SessionGap> SessionGaps::apply(const EventHead& head, const PacketBegin& /*event*/) {
  auto* trace = trace_of(head.stream);
  if (trace == nullptr || trace->is_open) return std::nullopt;
  auto& host = *trace->host;
  const bool is_nobody_here = !trace->has_begun && host.traces == 0;
  const bool is_before_runs = !host.has_told_runs;
  host.has_told_runs = host.has_told_runs || trace->has_callback_events;
  trace->has_begun = true;
  trace->is_open = true;
  ++host.traces;
  if (!is_nobody_here || !host.end || *host.end >= head.time) return std::nullopt;
  return SessionGap{.begin = *host.end, .end = head.time, .is_before_runs = is_before_runs};
}

void SessionGaps::apply(const EventHead& head, const PacketEnd& /*event*/) {
  auto* trace = trace_of(head.stream);
  if (trace == nullptr) return;
  auto& end = trace->host->end;
  end = std::max(end.value_or(head.time), head.time);
}

void SessionGaps::apply(const EventHead& head, const StreamEnd& /*event*/) {
  auto* trace = trace_of(head.stream);
  if (trace == nullptr) return;
  streams_[static_cast<std::size_t>(head.stream)] = nullptr;
  if (--trace->streams > 0 || !trace->is_open) return;
  trace->is_open = false;
  --trace->host->traces;
}

}  // namespace cie::analysis
