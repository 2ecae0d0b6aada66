// The trackers of one analysis, and what each category of events tells which of them.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/event.hpp>

#include "model/facts.hpp"
#include "trackers/chain_tracker.hpp"
#include "trackers/enforcement_tracker.hpp"
#include "trackers/host_clocks.hpp"
#include "trackers/instance_builder.hpp"
#include "trackers/queue_tracker.hpp"
#include "trackers/recording_tracker.hpp"
#include "trackers/registry.hpp"
#include "trackers/thread_timeline.hpp"
#include "trackers/window_cut.hpp"
#include "vocabulary/translator.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

namespace cie::analysis {

struct Analyzer::Pipeline {
  Pipeline(const AnalysisOptions& analysis_options, Observer* instance_observer)
      : options(analysis_options),
        observer(instance_observer),
        registry(model, analysis_options.spec),
        recording(model, registry, analysis_options.window, analysis_options.is_live),
        clocks(model),
        queues(model, registry),
        chains(std::in_place, model, registry, clocks, recording.loss_times(), options.spec),
        instances(std::in_place, model, registry, recording, timeline, clocks, *chains,
                  options.spec, observer),
        enforcement(model, registry, recording, timeline, *instances) {
    if (!options.window) return;
    cut.emplace(*options.window, model, registry, *instances);
    if (options.window->from != TimeWindow{}.from) enforcement.await_window();
  }

  // An event of whatever kind. Part of the loop over a batch, as to call it takes a twentieth of what
  // it does.
  inline void consume(const Event& event);
  // The same by a call.
  void consume_apart(const Event& event);
  // Events by their category. Hot are those of callbacks and clocks, and of the system.
  // `kMayBeCut`: there may be a window, or it is an event of clocks.
  template <bool kMayBeCut>
  inline void consume_user(const Event& event);
  // Such events, by a call.
  void consume_user_apart(const Event& event);
  inline void consume_system(const Event& event);
  void consume_state(const Event& event);
  void consume_structure(const Event& event);
  // A start that tells of its end, of a host whose kernel tells nothing: without a look at most of what
  // is looked at for each of the two. False: it was not consumed.
  inline bool consume_at_once(const EventHead& head, const CallbackStart& start);

  // Hints of events to come cost more than they gain unless so many callbacks run that what is known of
  // them does not stay in the processor's cache.
  bool is_worth_prefetching() const noexcept;
  struct Hints;

  void count(const Event& event) {
    count_only(event);
    now = event.head.time;
  }
  [[gnu::always_inline]] void count_only(const Event& event) {
    ++by_class[event.body.index()];
    if (event.head.is_derived && !event.head.stands_for_cause) return;
    const auto* other = std::get_if<OtherEvent>(&event.body);
    count_recorded(event.head.stream, other != nullptr ? other->count : 1);
  }
  void count_recorded(StreamIndex stream, std::uint64_t count) {
    model.events.total += count;
    recording.count_events(stream, count);
  }

  // An event of our provider: a thread of a process spoke.
  [[gnu::always_inline]] Emitter note_user(const EventHead& head) {
    ++model.events.cie;
    if (!head.pid) ++model.events.cie_without_pid;
    if (!head.tid) ++model.events.cie_without_tid;
    const auto who = registry.emitter_of(head);
    note_cpu(head, who);
    // What is told when all is over has no CPU: its thread may have left since.
    const bool is_running = head.cpu || !head.is_derived;
    if (recording.has_kernel(who.host) && head.tid && is_running) note_running(head, who);
    if (who.thread) enforcement.on_user_event(head, *who.thread);
    return who;
  }
  // A process with events of its own is one of the report; who only keeps the time, as a recorder may,
  // is none.
  void note_own(const EventHead& head, const Emitter& who) {
    if (head.is_derived || !who.process) return;
    auto& process = registry.process_facts_of(who);
    if (!process.has_cie_events) Registry::note_reported(head, process);
  }
  // Its events prove that a thread runs, if the kernel names it as they do.
  void note_running(const EventHead& head, const Emitter& who) {
    using Shown = ThreadTimeline::Shown;
    if (!who.thread) {
      timeline.on_user_event(who.host, *head.tid, head.cpu, head.time, false);
    } else if (!registry.facts_of(who).is_known_to_kernel) {
      if (timeline.is_there(who.host, *head.tid, head.cpu)) registry.note_place(*who.process, true);
    } else {
      const bool is_named_so = is_pid_ns_known(registry.process_facts_of(who));
      const auto shown =
          timeline.on_user_event(who.host, *head.tid, head.cpu, head.time, is_named_so);
      if (is_named_so || shown == Shown::nothing) return;
      registry.note_place(*who.process, shown == Shown::there);
    }
  }
  // A thread emitted an event on a CPU, of which the kernel may have recorded nothing.
  [[gnu::always_inline]] void note_cpu(const EventHead& head, const Emitter& who) {
    // Without the kernel's events it is enough to have seen the CPU once.
    const bool tells_nothing = !who.is_elsewhere && !recording.coverage().is_any();
    if (!tells_nothing && head.cpu) see_cpu(head, who);
  }
  void see_cpu(const EventHead& head, const Emitter& who) {
    if (recording.coverage().see(who.host, *head.cpu) || !who.thread) return;
    auto& thread = model.threads[at(*who.thread)];
    if (!thread.ran_unrecorded) thread.ran_unrecorded = ref(head);
  }

  // What a hot event tells the trackers. Of those of the kernel `who` is no more than the host.
  struct HotEventVisitor;
  template <bool kMayBeCut>
  inline void apply(const Event& event, const Emitter& who);

  // Of state.
  struct StateEventVisitor;
  bool is_left_out(const Event& event);
  // Before an event's emitter is looked up: a process that begins is not whoever had its pid before.
  void detect_reused_pid(const Event& event);
  // Of what is left out, an audit still tells that nothing changed until then.
  void pass_by_state(const Event& event);

  // Of structure.
  void begin_stream(const EventHead& head, const StreamBegin& e);
  void end_stream(const EventHead& head, const StreamEnd& e);
  void begin_packet(const EventHead& head, const PacketBegin& e);
  void note_hole(const EventHead& head, Timestamp begin, Timestamp end);

  // A hole that the kernel's record itself reveals.
  void note_missing_switches(HostIndex host, const ThreadTimeline::Hole& hole, Timestamp time);
  // Of a switch behind the window: what it hid until then lies in it.
  void note_switch_behind(const EventHead& head, HostIndex host, const SchedSwitch& event);
  // Those that no switch revealed: the record, or what counts of it, ended before.
  void note_open_holes();

  // The window that was asked for, or a snapshot's. Each event but those of structure passes the
  // window's edges; true if it lies outside.
  bool is_outside(const Event& event) { return cut && pass_edges(event); }
  bool pass_edges(const Event& event);
  // A hot event outside the window; true if what it tells holds in it all the same.
  bool pass_by(const Event& event, const Emitter& who);
  // A snapshot's window begins with the channel of its callbacks, which the first of their events
  // will tell: it may have begun long before.
  void note_possible_begin(const EventHead& head);

  // When all was consumed, or so far, and the facts are totalled.
  AnalysisResult judge();
  void name_events();

  AnalysisOptions options;
  Observer* observer;
  Model model;
  Registry registry;
  RecordingTracker recording;
  ThreadTimeline timeline;
  HostClocks clocks;
  QueueTracker queues;
  std::optional<ChainTracker> chains;  // these two until all instances are counted
  std::optional<InstanceBuilder> instances;
  EnforcementTracker enforcement;
  enum class WindowPosition : std::uint8_t { before, inside, after };
  std::optional<WindowCut> cut;
  WindowPosition position = WindowPosition::before;  // of the last event
  std::array<std::uint64_t, std::variant_size_v<EventBody>> by_class{};
  Timestamp now;
  std::unique_ptr<Translator> translator;  // of analyze()
};

}  // namespace cie::analysis
