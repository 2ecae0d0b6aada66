// Where events lie to the window, and what those outside it tell.
#include "pipeline.hpp"

namespace cie::analysis {

bool Analyzer::Pipeline::pass_edges(const Event& event) {
  const auto time = event.head.time;
  // What is not of callbacks may be in a channel that begins earlier.
  if (cut->is_awaiting_begin() && category_of(event.body) == EventCategory::callback) {
    if (const auto begin = recording.window_of(event.head.stream).begin) cut->begin_at(*begin);
  }
  if (position == WindowPosition::before && !cut->is_before(time)) {
    position = WindowPosition::inside;
    enforcement.begin_window(cut->window().from);
  }
  if (position == WindowPosition::inside && cut->is_after(time)) {
    position = WindowPosition::after;
    enforcement.end_window(cut->window().to);
  }
  return cut->is_before(time) || cut->is_after(time);
}

void Analyzer::Pipeline::note_switch_behind(const EventHead& head, HostIndex host,
                                            const SchedSwitch& event) {
  if (!head.cpu) return;
  const auto hole = timeline.on_switch_behind(host, *head.cpu, head.time, event);
  if (hole) note_missing_switches(host, *hole, head.time);
}

bool Analyzer::Pipeline::pass_by(const Event& event, const Emitter& who) {
  cut->pass_by(event.head, who, event.body);
  const bool is_before = cut->is_before(event.head.time);
  return std::visit(
      Overloaded{
          [](const SchedProcessExit&) { return true; },
          [](const SchedProcessExec&) { return true; }, [](const ProcessName&) { return true; },
          [](const ClockSync&) { return true; }, [](const ThreadWakeup&) { return true; },
          [](const CallbackStart&) { return false; }, [](const CallbackEnd&) { return false; },
          [](const CallbackRelease&) { return false; }, [](const SampleLost&) { return false; },
          [](const Publish&) { return false; }, [](const PublishFailed&) { return false; },
          [](const UntracedInstance&) { return false; }, [](const ResponseTaken&) { return false; },
          [](const ForeignCallback& told) { return !told.ran; },
          [&](const SchedSwitch& e) {
            if (!is_before) note_switch_behind(event.head, who.host, e);
            return is_before;
          },
          [is_before](const auto&) { return is_before; }},  // the kernel's
      event.body);
}

void Analyzer::Pipeline::note_possible_begin(const EventHead& head) {
  if (!cut || !cut->is_awaiting_begin() || recording.is_kernel(head.stream)) return;
  if (recording.window_of(head.stream).begin == head.time)
    enforcement.note_possible_begin(head.time);
}

}  // namespace cie::analysis
