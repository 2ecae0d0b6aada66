// What each kind of hot event tells the trackers. In a header, as it is part of consume().
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/instance.hpp>

#include "pipeline.hpp"

#include <optional>

namespace cie::analysis {

struct Analyzer::Pipeline::HotEventVisitor {
  Pipeline& pipeline;
  const EventHead& head;
  const Emitter& who;

  void operator()(const CallbackRelease& e) const {
    pipeline.queues.apply(head, who, e, pipeline.cut && pipeline.cut->is_snapshot());
  }
  void operator()(const SampleLost& e) const { pipeline.queues.apply(head, who, e); }
  void operator()(const PublishFailed& e) const { pipeline.queues.apply(who, e); }
  void operator()(const ThreadWakeup& e) const { pipeline.instances->apply(head, who, e); }
  [[gnu::always_inline]] void operator()(const CallbackStart& e) const {
    const auto runner = pipeline.registry.runner_of(head, who);
    if (runner.thread != who.thread) {
      pipeline.enforcement.on_thread_began(runner.host, *runner.thread);
    }
    pipeline.instances->apply(head, runner, e);
  }
  void operator()(const CallbackEnd& e) const { pipeline.instances->apply(head, who, e); }
  void operator()(const Publish& e) const { pipeline.instances->apply(head, who, e); }
  void operator()(const UntracedInstance& e) const { pipeline.registry.apply(who, e); }
  void operator()(const ForeignInstance& e) const {
    if (!pipeline.instances->is_running(who)) pipeline.registry.apply(head, e);
  }
  void operator()(const ForeignCallback& e) const { pipeline.registry.apply(head, e); }
  void operator()(const ResponseTaken& e) const {
    pipeline.chains->on_response(who.host, e, head.time);
  }
  void operator()(const ClockSync& e) const {
    if (head.is_derived) {
      pipeline.clocks.apply_shown(who.host, e);
      return;
    }
    pipeline.clocks.apply(who.host, e);
    pipeline.instances->clocks_were_read(who.host);
  }

  void operator()(const SchedSwitch& e) const {
    pipeline.model.hosts[at(who.host)].has_switches = true;
    if (!head.cpu) return;
    pipeline.recording.coverage().note_switch(head.stream, *head.cpu, head.time);
    const auto hole = pipeline.timeline.on_switch(who.host, *head.cpu, head.time, e,
                                                  is_told() ? pipeline.observer : nullptr);
    if (hole) pipeline.note_missing_switches(who.host, *hole, head.time);
    pipeline.enforcement.on_switch(head, who.host, e);
  }
  void operator()(const SchedWaking& e) const {
    pipeline.model.hosts[at(who.host)].has_wakings = true;
    pipeline.timeline.on_waking(who.host, e.tid, head.time);
    tell_waking(e);
  }
  void operator()(const SchedWakeup& e) const {
    pipeline.model.hosts[at(who.host)].has_wakings = true;
    // A waking names the CPU of before, which may be gone.
    if (e.target_cpu) pipeline.recording.coverage().see(who.host, *e.target_cpu);
    if (pipeline.timeline.on_wakeup(who.host, e.tid, head.time)) tell_waking(e);
  }
  void operator()(const SchedProcessFork& e) const {
    pipeline.model.hosts[at(who.host)].has_forks = true;
    pipeline.enforcement.on_fork(head, who.host, e);
  }
  void operator()(const SchedProcessExit& e) const {
    pipeline.instances->on_exit(head, who.host, e.tid);
    pipeline.registry.apply(head, e);
    pipeline.timeline.on_exit(who.host, e.tid);
  }
  void operator()(const SchedProcessExec& e) const { pipeline.registry.apply(head, e); }
  void operator()(const SchedMigrateTask& e) const {
    pipeline.recording.coverage().see(who.host, e.dest_cpu);
    pipeline.timeline.on_migrate(who.host, e.tid, e.dest_cpu, head.time);
  }
  void operator()(const SchedPiSetprio& e) const {
    pipeline.enforcement.on_pi_setprio(head, who.host, e);
  }
  void operator()(const ProcessName& e) const { pipeline.registry.apply(head, e); }
  template <typename Other>
  void operator()(const Other& /*event*/) const {}

  // Observers are told nothing from before the window.
  bool is_told() const { return !pipeline.cut || !pipeline.cut->is_before(head.time); }
  template <typename WakeUp>
  void tell_waking(const WakeUp& event) const {
    if (pipeline.observer == nullptr || !is_told()) return;
    pipeline.observer->on_waking(Waking{
        .time = head.time,
        .tid = event.tid,
        .priority = event.prio,
        .cpu = head.cpu,
        .waker_tid = head.cpu ? pipeline.timeline.running_on(who.host, *head.cpu) : std::nullopt,
        .target_cpu = event.target_cpu,
        .host = who.host});
  }
};

}  // namespace cie::analysis
