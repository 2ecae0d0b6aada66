// What events of state tell the trackers: who there is, and how it is scheduled.
#include "pipeline.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

struct Analyzer::Pipeline::StateEventVisitor {
  Pipeline& pipeline;
  const EventHead& head;

  // Totals: as they were at the window's end.
  template <typename Totals>
  auto apply_cut(const Totals& e) const {
    return pipeline.registry.apply(head, pipeline.cut ? pipeline.cut->cut(head, e) : e);
  }

  void operator()(const RunBegin& e) const {
    auto& registry = pipeline.registry;
    registry.apply(head, e);
    pipeline.recording.coverage().expect(registry.host_of(head), e.online_cpus);
    pipeline.clocks.apply(registry.host_of(head), e);
    pipeline.instances->clocks_were_read(registry.host_of(head));
  }
  void operator()(const PublisherInit& e) const {
    pipeline.registry.apply(head, e);
    pipeline.instances->publisher_announced();
  }
  void operator()(const ThreadInit& e) const {
    const auto thread = pipeline.registry.apply(head, e);
    if (!thread) return;
    const auto& facts = pipeline.model.threads[at(*thread)];
    const bool is_new = facts.announced && facts.announced->time == head.time;
    if (!is_new) return;
    const auto host = pipeline.registry.host_of(head);
    pipeline.enforcement.on_thread_began(host, *thread);
    if (facts.ran.empty()) pipeline.instances->thread_began(host, *thread);
  }
  void operator()(const ThreadFini& e) const {
    const auto thread = apply_cut(e);
    if (thread) pipeline.enforcement.on_thread_fini(head, *thread);
  }
  void operator()(const ThreadSched& e) const {
    const auto host = pipeline.registry.host_of(head);
    for (const auto cpu : e.cpus)  // the kernel tells those alone that are there
      pipeline.recording.coverage().see(host, static_cast<std::int32_t>(cpu));
    const auto thread = pipeline.registry.apply(head, e);
    if (thread) pipeline.enforcement.on_read_back(head, *thread, e);
  }
  void operator()(const RunEnd& e) const { apply_cut(e); }
  void operator()(const PublisherFini& e) const { apply_cut(e); }
  void operator()(const CallbackFini& e) const {
    const auto totals = pipeline.cut ? pipeline.cut->cut(head, e) : std::optional(e);
    if (totals) pipeline.registry.apply(head, *totals);
  }
  template <typename Other>
  void operator()(const Other& e) const {
    if constexpr (requires { pipeline.registry.apply(head, e); }) pipeline.registry.apply(head, e);
  }
};

void Analyzer::Pipeline::consume_state(const Event& event) {
  const auto& head = event.head;
  if (cut) pass_edges(event);  // what is told of state outside the window holds in it, too
  count(event);
  if (!is_left_out(event)) detect_reused_pid(event);
  note_own(head, note_user(head));
  if (is_left_out(event)) {
    pass_by_state(event);
  } else {
    std::visit(StateEventVisitor{.pipeline = *this, .head = head}, event.body);
    if (cut) cut->see_announced(head, event.body);
  }
  instances->advance(head);
}

bool Analyzer::Pipeline::is_left_out(const Event& event) {
  return cut && cut->leaves_out(event.head, event.body);
}

void Analyzer::Pipeline::detect_reused_pid(const Event& event) {
  if (const auto* begin = std::get_if<RunBegin>(&event.body)) {
    registry.detect_reused_pid(event.head, *begin, recording.loss_times());
    return;
  }
  registry.detect_another_program(event.head, event.body);
  if (registry.has_any_ended())
    registry.detect_reused_pid_after_end(event.head, event.body, recording.loss_times());
}

void Analyzer::Pipeline::pass_by_state(const Event& event) {
  const auto* read_back = std::get_if<ThreadSched>(&event.body);
  if (read_back == nullptr || read_back->moment != SchedMoment::audit) return;
  const auto thread = registry.thread_by_tid(registry.host_of(event.head), read_back->tid);
  if (thread) enforcement.on_later_audit(*thread, read_back_of(event.head, *read_back));
}

}  // namespace cie::analysis
