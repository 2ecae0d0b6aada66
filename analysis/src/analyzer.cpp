#include <cie/analysis/analyzer.hpp>

#include "model/doubtful_ids.hpp"
#include "model/facts.hpp"
#include "model/host_clocks.hpp"
#include "report/report_builder.hpp"
#include "rules/rule.hpp"
#include "trackers/chain_tracker.hpp"
#include "trackers/enforcement_tracker.hpp"
#include "trackers/instance_builder.hpp"
#include "trackers/queue_tracker.hpp"
#include "trackers/recording_tracker.hpp"
#include "trackers/registry.hpp"
#include "trackers/thread_timeline.hpp"
#include "trackers/window_cut.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

namespace cie::analysis {

namespace {

constexpr auto kCallbackStart = EventBody(CallbackStart{}).index();
constexpr auto kCallbackEnd = EventBody(CallbackEnd{}).index();

// The event that a start tells of.
Event end_of(const EventHead& head, const CallbackStart& start) {
  Event end{.head = head,
            .body = CallbackEnd{.callback = start.callback, .seq = start.seq, .status = {}}};
  end.head.time = *start.end;
  return end;
}

}  // namespace

struct Analyzer::Pipeline {
  Pipeline(const AnalysisOptions& analysis_options, Observer* instance_observer)
      : options(analysis_options),
        observer(instance_observer),
        registry(model, analysis_options.spec),
        recording(model, registry, analysis_options.window, analysis_options.is_live),
        clocks(model),
        queues(model, registry),
        chains(std::in_place, model, registry, clocks, recording.user_losses(), options.spec),
        instances(std::in_place, model, registry, recording, timeline, clocks, *chains,
                  options.spec, observer),
        enforcement(model, registry, recording, timeline, *instances) {
    if (!options.window) return;
    cut.emplace(*options.window, model, registry, *instances);
    if (options.window->from != TimeWindow{}.from) enforcement.await_window();
  }

  void count(const Event& event) {
    count_only(event);
    now = event.head.time;
  }
  void count_only(const Event& event) {
    ++by_class[event.body.index()];
    if (event.head.is_derived && !event.head.stands_for_cause) return;
    const auto* other = std::get_if<OtherEvent>(&event.body);
    count_recorded(event.head.stream, other != nullptr ? other->count : 1);
  }
  void count_recorded(StreamIndex stream, std::uint64_t count) {
    model.events.total += count;
    recording.count_events(stream, count);
  }

  // Passes the edges of the window that was asked for; true for a hot event outside it.
  bool is_outside(const Event& event) {
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

  // What a hot event outside the window still tells: who lives, who runs where, what was counted.
  void pass_by(const Event& event, const Emitter& who) {
    cut->pass_by(event.head, who, event.body);
    const bool is_before = cut->is_before(event.head.time);
    const bool is_kept = std::visit(
        Overloaded{
            [](const SchedProcessExit&) { return true; }, [](const ProcessName&) { return true; },
            [](const ClockSync&) { return true; }, [](const ThreadWakeup&) { return true; },
            [](const CallbackStart&) { return false; }, [](const CallbackEnd&) { return false; },
            [](const CallbackRelease&) { return false; }, [](const SampleLost&) { return false; },
            [](const Publish&) { return false; }, [](const HiddenRun&) { return false; },
            [](const ResponseTaken&) { return false; },
            [is_before](const auto&) { return is_before; }},  // the kernel's
        event.body);
    if (is_kept) hot(event, who);
  }

  // An event of our provider: a thread of a process spoke.
  Emitter note_user(const EventHead& head) {
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

  void note_hole(const EventHead& head, Timestamp begin, Timestamp end) {
    const auto& coverage = recording.coverage();
    if (recording.is_kernel(head.stream) && coverage.is_evidence(head.stream) &&
        coverage.costs(head, end)) {
      timeline.add_hole(registry.host_of(head),
                        {.begin = begin, .end = end, .cpu = head.cpu.value_or(-1)});
    }
  }

  // A snapshot's window begins with the channel of its callbacks, which the first of their events
  // will tell: it may have begun long before.
  void note_possible_begin(const EventHead& head) {
    if (!cut || !cut->is_awaiting_begin() || recording.is_kernel(head.stream)) return;
    if (recording.window_of(head.stream).begin == head.time)
      enforcement.note_possible_begin(head.time);
  }

  void structural(const Event& event) {
    const auto& head = event.head;
    std::visit(
        Overloaded{[&](const StreamBegin& e) {
                     recording.apply(head, e);
                     // The kernel's trace measured the same clocks once more, or others.
                     if (e.domain == Domain::user) clocks.apply(registry.host_of(head), e);
                     if (!e.is_snapshot) return;
                     if (!cut) {
                       cut.emplace(options.window.value_or(TimeWindow{}), model, registry,
                                   *instances);
                     }
                     cut->await_begin();
                     note_possible_begin(head);
                   },
                   [&](const StreamEnd& e) { recording.apply(head, e); },
                   [&](const PacketBegin& e) {
                     if (const auto cpu = recording.apply(head, e)) {
                       timeline.begin_anew(registry.host_of(head), *cpu);
                     }
                     note_possible_begin(head);
                   },
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

  void prefetch_subject(const Event& event) const noexcept {
    const auto* emitter = registry.known_emitter_of(event.head);
    if (emitter == nullptr) return;
    if (std::holds_alternative<Publish>(event.body)) {
      registry.prefetch_publication(*emitter);
    } else {
      enforcement.prefetch(emitter->thread);
      instances->prefetch(*emitter);
    }
  }

  // A start that tells of its end, of a host whose kernel tells nothing: without a look at most of what
  // consume() looks at for each of the two. False: it was not consumed.
  bool run_at_once(const EventHead& head, const CallbackStart& start) {
    if (cut || !head.stands_for_cause) return false;
    auto* const known = registry.known_emitter_of(head);
    const bool is_usual = known != nullptr && !known->thread_facts->fini &&
                          !recording.has_kernel(known->host) &&
                          !enforcement.heeds_events_of(known->thread);
    if (!is_usual) return false;
    const auto who = registry.see_again(*known, head.cpu, *start.end);
    note_cpu(head, who);
    constexpr std::uint64_t kBoth = 2;
    ++by_class[kCallbackStart];
    ++by_class[kCallbackEnd];
    count_recorded(head.stream, kBoth);
    model.events.cie += kBoth;
    now = *start.end;
    instances->apply_with_end(head, who, start, now);
    auto end = head;
    end.time = now;
    instances->advance(end);
    return true;
  }

  // Hot events. Of those of the kernel `who` is no more than the host.
  [[gnu::always_inline]] void hot(const Event& event, const Emitter& who) {
    if (cut && !cut->is_before(event.head.time)) cut->see_inside(who, event.body);
    // Most often one of these.
    if (const auto* start = std::get_if<CallbackStart>(&event.body)) {
      on(event.head, who, *start);
      return;
    }
    if (const auto* end = std::get_if<CallbackEnd>(&event.body)) {
      on(event.head, who, *end);
      return;
    }
    std::visit([&](const auto& body) { on(event.head, who, body); }, event.body);
  }

  void on(const EventHead& head, const Emitter& who, const CallbackRelease& e) {
    queues.apply(head, who, e, cut && cut->is_snapshot());
  }
  void on(const EventHead& head, const Emitter& who, const SampleLost& e) {
    queues.apply(head, who, e);
  }
  void on(const EventHead& head, const Emitter& who, const ThreadWakeup& e) {
    instances->apply(head, who, e);
  }
  [[gnu::always_inline]] void on(const EventHead& head, const Emitter& who,
                                 const CallbackStart& e) {
    const auto runner = registry.runner_of(head, who);
    if (runner.thread != who.thread) {
      enforcement.on_thread_began(runner.host, *runner.thread);
    }
    instances->apply(head, runner, e);
  }
  void on(const EventHead& head, const Emitter& who, const CallbackEnd& e) {
    instances->apply(head, who, e);
  }
  void on(const EventHead& head, const Emitter& who, const Publish& e) {
    instances->apply(head, who, e);
  }
  void on(const EventHead& /*head*/, const Emitter& who, const HiddenRun& e) {
    registry.apply(who, e);
  }
  void on(const EventHead& head, const Emitter& who, const ResponseTaken& e) {
    chains->on_response(who.host, e, head.time);
  }
  void on(const EventHead& head, const Emitter& who, const ClockSync& e) {
    if (head.is_derived) {
      clocks.apply_shown(who.host, e);
      return;
    }
    clocks.apply(who.host, e);
    instances->clocks_were_read(who.host);
  }
  void on(const EventHead& head, const Emitter& who, const SchedSwitch& e) {
    model.hosts[at(who.host)].has_switches = true;
    if (!head.cpu) return;
    recording.coverage().note_switch(head.stream, *head.cpu, head.time);
    const bool is_told = !cut || !cut->is_before(head.time);
    const auto hole =
        timeline.on_switch(who.host, *head.cpu, head.time, e, is_told ? observer : nullptr);
    if (hole) {
      recording.add_loss(Loss{.kind = LossKind::switch_mismatch,
                              .domain = Domain::kernel,
                              .host = who.host,
                              .begin = hole->begin,
                              .end = hole->end,
                              .count = std::nullopt,
                              .cpu = hole->cpu,
                              .note = {}});
    }
    enforcement.on_switch(head, who.host, e);
  }
  template <typename WakeUp>
  void tell_waking(const EventHead& head, HostIndex host, const WakeUp& event) {
    if (observer == nullptr || (cut && cut->is_before(head.time))) return;
    observer->on_waking(
        Waking{.time = head.time,
               .tid = event.tid,
               .priority = event.prio,
               .cpu = head.cpu,
               .waker_tid = head.cpu ? timeline.running_on(host, *head.cpu) : std::nullopt,
               .target_cpu = event.target_cpu,
               .host = host});
  }
  void on(const EventHead& head, const Emitter& who, const SchedWaking& e) {
    model.hosts[at(who.host)].has_wakings = true;
    timeline.on_waking(who.host, e.tid, head.time);
    tell_waking(head, who.host, e);
  }
  void on(const EventHead& head, const Emitter& who, const SchedWakeup& e) {
    model.hosts[at(who.host)].has_wakings = true;
    if (timeline.on_wakeup(who.host, e.tid, head.time)) tell_waking(head, who.host, e);
  }
  void on(const EventHead& head, const Emitter& who, const SchedProcessFork& e) {
    model.hosts[at(who.host)].has_forks = true;
    enforcement.on_fork(head, who.host, e);
  }
  void on(const EventHead& head, const Emitter& who, const SchedProcessExit& e) {
    registry.apply(head, e);
    timeline.on_exit(who.host, e.tid);
  }
  void on(const EventHead& head, const Emitter& who, const SchedMigrateTask& e) {
    recording.coverage().see(who.host, e.dest_cpu);
    timeline.on_migrate(who.host, e.tid, e.dest_cpu, head.time);
  }
  void on(const EventHead& /*head*/, const Emitter& who, const SchedPiSetprio& e) {
    enforcement.on_pi_setprio(who.host, e);
  }
  void on(const EventHead& head, const Emitter& /*who*/, const ProcessName& e) {
    registry.apply(head, e);
  }
  template <typename Other>
  void on(const EventHead& /*head*/, const Emitter& /*who*/, const Other& /*event*/) {}

  // Before an event's emitter is looked up: a process that begins is not whoever had its pid before.
  void meet(const Event& event, EventCategory category) {
    const bool is_state = category == EventCategory::state;
    if (is_state && cut && cut->leaves_out(event.head, event.body)) return;
    if (const auto* begin = std::get_if<RunBegin>(&event.body)) {
      registry.meet(event.head, *begin);
    } else if (registry.has_any_ended()) {
      registry.meet_after_end(event.head, event.body, recording.user_losses());
    }
  }

  void state(const Event& event) {
    if (cut && cut->leaves_out(event.head, event.body)) {
      pass_by_state(event);
      return;
    }
    std::visit([&](const auto& body) { on_state(event.head, body); }, event.body);
    if (cut) cut->see_announced(event.head, event.body);
  }
  // Of what is left out, an audit still tells that nothing changed until then.
  void pass_by_state(const Event& event) {
    const auto* read_back = std::get_if<ThreadSched>(&event.body);
    if (read_back == nullptr || read_back->moment != SchedMoment::audit) return;
    const auto thread = registry.thread_by_tid(registry.host_of(event.head), read_back->tid);
    if (thread) enforcement.on_later_audit(*thread, read_back_of(event.head, *read_back));
  }
  void on_state(const EventHead& head, const RunBegin& e) {
    registry.apply(head, e);
    recording.coverage().expect(registry.host_of(head), e.online_cpus);
    clocks.apply(registry.host_of(head), e);
    instances->clocks_were_read(registry.host_of(head));
  }
  void on_state(const EventHead& head, const ThreadInit& e) {
    const auto thread = registry.apply(head, e);
    if (!thread) return;
    const auto& facts = model.threads[at(*thread)];
    const bool is_new = facts.announced && facts.announced->time == head.time;
    if (!is_new) return;
    const auto host = registry.host_of(head);
    enforcement.on_thread_began(host, *thread);
    if (facts.ran.empty()) instances->thread_began(host, *thread);
  }
  void on_state(const EventHead& head, const ThreadFini& e) {
    enforcement.on_thread_fini(head, registry.host_of(head), e.tid);
    registry.apply(head, cut ? cut->cut(head, e) : e);
  }
  void on_state(const EventHead& head, const ThreadSched& e) {
    const auto thread = registry.apply(head, e);
    if (thread) enforcement.on_read_back(head, *thread, e);
  }
  void on_state(const EventHead& head, const RunEnd& e) {
    registry.apply(head, cut ? cut->cut(head, e) : e);
  }
  void on_state(const EventHead& head, const CallbackFini& e) {
    const auto totals = cut ? cut->cut(head, e) : std::optional(e);
    if (totals) registry.apply(head, *totals);
  }
  void on_state(const EventHead& head, const PublisherFini& e) {
    registry.apply(head, cut ? cut->cut(head, e) : e);
  }
  template <typename Other>
  void on_state(const EventHead& head, const Other& e) {
    if constexpr (requires { registry.apply(head, e); }) registry.apply(head, e);
  }

  void name_events() {
    for (std::size_t i = 0; i < kEventNames.size(); ++i) {
      if (!kEventNames[i].empty() && by_class[i] > 0) {
        model.events.by_name[std::string(kEventNames[i])] = by_class[i];
      }
    }
  }

  // From facts that are totalled.
  AnalysisResult judge() const {
    AnalysisResult result;
    const RuleContext context(model, options);
    result.verdicts = verify(context);
    if (cut && model.begin && model.end) {
      result.verdicts.window = TimeWindow{.from = *model.begin, .to = *model.end};
    }
    result.report = build_report(context, result.verdicts);
    return result;
  }

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
  WindowPosition position = WindowPosition::before;
  std::array<std::uint64_t, std::variant_size_v<EventBody>> by_class{};
  Timestamp now;
};

Analyzer::Analyzer(const AnalysisOptions& options, Observer* observer)
    : pipeline_(std::make_unique<Pipeline>(options, observer)) {}
Analyzer::~Analyzer() = default;
Analyzer::Analyzer(Analyzer&&) noexcept = default;
Analyzer& Analyzer::operator=(Analyzer&&) noexcept = default;

void Analyzer::consume(const Event& event) {
  auto& pipeline = *pipeline_;
  const auto* start = std::get_if<CallbackStart>(&event.body);
  const bool has_end = start != nullptr && start->end;
  if (has_end && pipeline.run_at_once(event.head, *start)) return;
  const auto category = category_of(event.body);
  if (category == EventCategory::structure) {
    pipeline.structural(event);
    return;
  }
  if (category == EventCategory::system && !pipeline.recording.coverage().tells(event.head)) {
    pipeline.count_only(event);
    return;
  }
  const bool is_passing_by =
      pipeline.cut && pipeline.is_outside(event) && category != EventCategory::state;
  if (!is_passing_by) pipeline.count(event);
  if (category == EventCategory::system) {
    const Emitter who{.host = pipeline.registry.host_of(event.head), .process = {}, .thread = {}};
    if (is_passing_by) {
      pipeline.pass_by(event, who);
      return;
    }
    pipeline.hot(event, who);
  } else {
    const bool may_be_another =
        category == EventCategory::state || pipeline.registry.has_any_ended();
    if (may_be_another && !is_passing_by) [[unlikely]]
      pipeline.meet(event, category);
    const auto who = pipeline.note_user(event.head);
    if (is_passing_by) {
      pipeline.pass_by(event, who);
    } else if (category == EventCategory::state) {
      pipeline.state(event);
    } else {
      pipeline.hot(event, who);
    }
    if (has_end) {
      if (!is_passing_by) pipeline.instances->advance(event.head);
      consume(end_of(event.head, *start));
      return;
    }
    if (is_passing_by) return;
  }
  pipeline.instances->advance(event.head);
}

bool Analyzer::is_worth_prefetching() const noexcept {
  constexpr std::size_t kInCache = 512;  // some 5 KB each: measured, a second-level cache's worth
  return pipeline_->model.pairs.size() > kInCache;
}

void Analyzer::prefetch_emitter(const EventHead& head) const noexcept {
  pipeline_->registry.prefetch(head);
}

void Analyzer::prefetch_subject(const Event& event) const noexcept {
  pipeline_->prefetch_subject(event);
}

void Analyzer::add(std::vector<Recording> recordings) {
  std::ranges::move(recordings, std::back_inserter(pipeline_->model.recordings));
}

AnalysisResult Analyzer::look() {
  auto& pipeline = *pipeline_;
  pipeline.name_events();
  pipeline.registry.finish();
  pipeline.recording.finish();
  pipeline.chains->look();
  pipeline.enforcement.look(pipeline.now);
  doubt_numbered_ids(pipeline.model);
  return pipeline.judge();
}

AnalysisResult Analyzer::finish() {
  auto& pipeline = *pipeline_;
  pipeline.name_events();
  if (pipeline.options.window) require_one_clock(pipeline.model);
  if (pipeline.cut) pipeline.cut->finish();
  pipeline.registry.finish();
  pipeline.recording.finish();
  pipeline.enforcement.finish();  // an open instance is work of its callback until the end
  pipeline.instances->finish();
  pipeline.chains->finish();
  // What they remember of the last instances is as large as the facts.
  pipeline.instances.reset();
  pipeline.chains.reset();
  doubt_numbered_ids(pipeline.model);
  return pipeline.judge();
}

}  // namespace cie::analysis
