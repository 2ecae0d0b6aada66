#include <cie/analysis/analyzer.hpp>

#include "hot_event_visitor.hpp"
#include "model/clock_differences.hpp"
#include "pipeline.hpp"
#include "vocabulary/event_batch.hpp"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <variant>

namespace cie::analysis {

namespace {

constexpr auto kCallbackStart = EventBody(CallbackStart{}).index();
constexpr auto kCallbackEnd = EventBody(CallbackEnd{}).index();
constexpr auto kThreadWakeup = EventBody(ThreadWakeup{}).index();
constexpr auto kPublish = EventBody(Publish{}).index();

// Where threads tell of their wake-ups, a callback will run on the thread. Other events follow on
// these soon enough.
bool is_foretelling(const Event& event) noexcept {
  return event.head.pid && !event.head.is_derived &&
         (std::holds_alternative<ThreadWakeup>(event.body) ||
          std::holds_alternative<Publish>(event.body));
}

// The event that a start tells of.
Event end_of(const EventHead& head, const CallbackStart& start) {
  Event end{.head = head,
            .body = CallbackEnd{.callback = start.callback, .seq = start.seq, .status = {}}};
  end.head.time = *start.end;
  return end;
}

}  // namespace

Analyzer::Analyzer(const AnalysisOptions& options, Observer* observer)
    : pipeline_(std::make_unique<Pipeline>(options, observer)) {}
Analyzer::~Analyzer() = default;
Analyzer::Analyzer(Analyzer&&) noexcept = default;
Analyzer& Analyzer::operator=(Analyzer&&) noexcept = default;

template <bool kMayBeCut>
[[gnu::always_inline]] inline void Analyzer::Pipeline::apply(const Event& event,
                                                             const Emitter& who) {
  if (kMayBeCut && cut && !cut->is_before(event.head.time))
    cut->see_inside(event.head, who, event.body);
  const HotEventVisitor visitor{.pipeline = *this, .head = event.head, .who = who};
  switch (event.body.index()) {  // most often one of these
    case kCallbackStart:
      visitor(*std::get_if<CallbackStart>(&event.body));
      break;
    case kCallbackEnd:
      visitor(*std::get_if<CallbackEnd>(&event.body));
      break;
    case kThreadWakeup:
      visitor(*std::get_if<ThreadWakeup>(&event.body));
      break;
    case kPublish:
      visitor(*std::get_if<Publish>(&event.body));
      break;
    default:
      std::visit(visitor, event.body);
  }
}

template <bool kMayBeCut>
[[gnu::always_inline]] inline void Analyzer::Pipeline::consume_user(const Event& event) {
  const bool is_passing_by = kMayBeCut && is_outside(event);
  if (!is_passing_by) {
    count(event);
    if (registry.has_any_ended()) [[unlikely]]
      registry.detect_reused_pid_after_end(event.head, event.body, recording.loss_times());
  }
  const auto who = note_user(event.head);
  if (!kMayBeCut || category_of(event.body) == EventCategory::callback) note_own(event.head, who);
  if (is_passing_by && !pass_by(event, who)) return;
  apply<kMayBeCut>(event, who);
  if (!is_passing_by) instances->advance(event.head);
}

[[gnu::always_inline]] inline void Analyzer::Pipeline::consume_system(const Event& event) {
  if (!recording.coverage().tells(event.head)) {
    count_only(event);
    return;
  }
  const bool is_passing_by = is_outside(event);
  if (!is_passing_by) count(event);
  const Emitter who{.host = registry.host_of(event.head), .process = {}, .thread = {}};
  if (is_passing_by && !pass_by(event, who)) return;
  apply<true>(event, who);
  if (!is_passing_by) instances->advance(event.head);
}

inline bool Analyzer::Pipeline::consume_at_once(const EventHead& head, const CallbackStart& start) {
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

[[gnu::always_inline]] inline void Analyzer::Pipeline::consume(const Event& event) {
  const auto* start = std::get_if<CallbackStart>(&event.body);
  const bool has_end = start != nullptr && start->end;
  if (has_end && consume_at_once(event.head, *start)) return;
  switch (category_of(event.body)) {
    case EventCategory::structure:
      consume_structure(event);
      return;
    case EventCategory::state:
      consume_state(event);
      return;
    case EventCategory::system:
      consume_system(event);
      return;
    case EventCategory::clock:
      consume_user_apart(event);
      return;
    case EventCategory::callback:
      if (cut) [[unlikely]] {
        consume_user_apart(event);
      } else {
        consume_user<false>(event);
      }
      break;
  }
  if (has_end) consume_apart(end_of(event.head, *start));
}

void Analyzer::Pipeline::consume_apart(const Event& event) { consume(event); }

void Analyzer::Pipeline::consume_user_apart(const Event& event) { consume_user<true>(event); }

void Analyzer::consume(const Event& event) { pipeline_->consume_apart(event); }

bool Analyzer::Pipeline::is_worth_prefetching() const noexcept {
  constexpr std::size_t kInCache = 512;  // some 5 KB each: measured, a second-level cache's worth
  const bool is_foretold = by_class[kThreadWakeup] > 0;  // not by ROS 2
  return is_foretold && model.pairs.size() > kInCache;
}

// What an event takes is on its way into the processor's cache when its turn comes. Each of the three
// finds what it asks for in what the one before it asked for.
struct Analyzer::Pipeline::Hints {
  const Pipeline& pipeline;

  void far(const Event& event) const noexcept {
    if (is_foretelling(event)) pipeline.registry.prefetch(event.head);
  }
  void near(const Event& event) const noexcept {
    const auto* emitter = emitter_of(event);
    if (emitter == nullptr) return;
    if (std::holds_alternative<Publish>(event.body)) {
      pipeline.registry.prefetch_publication(*emitter);
      pipeline.chains->prefetch_publication(*emitter);
    } else {
      pipeline.enforcement.prefetch(emitter->thread);
      pipeline.instances->prefetch(*emitter);
    }
  }
  void next(const Event& event) const noexcept {
    const auto* emitter = emitter_of(event);
    if (emitter == nullptr) return;
    if (std::holds_alternative<Publish>(event.body)) {
      pipeline.chains->prefetch_message(*emitter);
    } else {
      pipeline.instances->prefetch_start(*emitter);
    }
  }

 private:
  const KnownEmitter* emitter_of(const Event& event) const noexcept {
    return is_foretelling(event) ? pipeline.registry.known_emitter_of(event.head) : nullptr;
  }
};

void Analyzer::consume(const EventBatch& batch) {
  auto& pipeline = *pipeline_;
  if (pipeline.is_worth_prefetching()) {
    batch.each(Pipeline::Hints{pipeline},
               [&pipeline](const Event& event) { pipeline.consume_apart(event); });
  } else {
    batch.each([&pipeline](const Event& event)
                   __attribute__((always_inline)) { pipeline.consume(event); });
  }
}

void Analyzer::add(std::vector<Recording> recordings) {
  std::ranges::move(recordings, std::back_inserter(pipeline_->model.recordings));
}

AnalysisResult Analyzer::look() {
  auto& pipeline = *pipeline_;
  pipeline.registry.finish();
  pipeline.recording.finish();
  pipeline.instances->look();
  pipeline.recording.finish_runs();
  pipeline.chains->look();
  pipeline.enforcement.look();
  return pipeline.judge();
}

AnalysisResult Analyzer::finish() {
  auto& pipeline = *pipeline_;
  if (pipeline.options.window) require_one_clock(pipeline.model);
  if (pipeline.cut) pipeline.cut->finish();
  pipeline.registry.finish();
  pipeline.recording.finish();
  pipeline.enforcement.finish();  // an open instance is work of its callback until the end
  pipeline.note_open_holes();
  // What both of these remember of the last instances is as large as the facts.
  pipeline.instances->finish();
  pipeline.instances.reset();
  pipeline.recording.finish_runs();
  pipeline.chains->finish();
  pipeline.chains.reset();
  return pipeline.judge();
}

}  // namespace cie::analysis
