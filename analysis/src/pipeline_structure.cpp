// What events of streams and packets tell the trackers.
#include "pipeline.hpp"

#include <cstddef>
#include <cstdint>

namespace cie::analysis {

void Analyzer::Pipeline::note_hole(const EventHead& head, Timestamp begin, Timestamp end) {
  const auto& coverage = recording.coverage();
  if (recording.is_kernel(head.stream) && coverage.is_evidence(head.stream) &&
      coverage.costs(head, end)) {
    const ThreadTimeline::Hole hole{.begin = begin, .end = end, .cpu = head.cpu.value_or(-1)};
    timeline.add_hole(registry.host_of(head), hole);
    instances->hole_was_told(registry.host_of(head), hole, head.time);
  }
}

void Analyzer::Pipeline::note_missing_switches(HostIndex host, const ThreadTimeline::Hole& hole,
                                               Timestamp time) {
  instances->hole_was_told(host, hole, time);
  recording.add_loss(Loss{.kind = LossKind::switch_mismatch,
                          .domain = Domain::kernel,
                          .host = host,
                          .begin = hole.begin,
                          .end = hole.end,
                          .count = std::nullopt,
                          .cpu = hole.cpu,
                          .note = {}});
}

void Analyzer::Pipeline::note_open_holes() {
  const auto end = cut ? cut->window().to : kLatest;
  for (std::size_t i = 0; i < model.hosts.size(); ++i) {
    const HostIndex host{static_cast<std::uint32_t>(i)};
    for (auto hole : timeline.open_holes(host, end)) {
      if (!recording.kernel_record(host, hole.end, hole.cpu).contains(hole.begin, hole.end))
        continue;
      hole.end = kLatest;  // not known
      timeline.add_hole(host, hole);
      note_missing_switches(host, hole, now);
    }
  }
}

void Analyzer::Pipeline::begin_stream(const EventHead& head, const StreamBegin& e) {
  recording.apply(head, e);
  // The kernel's trace measured the same clocks once more, or others.
  if (e.domain == Domain::user) clocks.apply(registry.host_of(head), e);
  if (!e.is_snapshot) return;
  if (!cut) cut.emplace(options.window.value_or(TimeWindow{}), model, registry, *instances);
  cut->await_begin();
  note_possible_begin(head);
}

void Analyzer::Pipeline::end_stream(const EventHead& head, const StreamEnd& e) {
  if (recording.apply(head, e)) enforcement.on_record_end(head.stream, head.time);
}

void Analyzer::Pipeline::begin_packet(const EventHead& head, const PacketBegin& e) {
  if (const auto cpu = recording.apply(head, e)) timeline.begin_anew(registry.host_of(head), *cpu);
  note_possible_begin(head);
}

void Analyzer::Pipeline::consume_structure(const Event& event) {
  const auto& head = event.head;
  std::visit(
      Overloaded{[&](const StreamBegin& e) { begin_stream(head, e); },
                 [&](const StreamEnd& e) { end_stream(head, e); },
                 [&](const PacketBegin& e) { begin_packet(head, e); },
                 [&](const PacketEnd& e) { recording.apply(head, e); },
                 [&](const Discarded& e) {
                   recording.apply(head, e);
                   note_hole(head, e.begin, e.end);
                 },
                 [&](const DamagedPacket& e) {
                   recording.apply(head, e);
                   note_hole(head, e.begin.value_or(head.time), e.end.value_or(head.time));
                 },
                 [&](const SessionGap& e) { recording.apply(head, e); },
                 [&](const TimeRegression& e) { recording.apply(head, e); }, [](const auto&) {}},
      event.body);
}

}  // namespace cie::analysis
