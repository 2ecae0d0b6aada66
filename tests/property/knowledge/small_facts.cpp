#include "small_facts.hpp"

#include <algorithm>
#include <map>

namespace cie::test::small {
namespace {

constexpr EventKinds kThreadMarks{EventKind::announcement, EventKind::thread_exit,
                                  EventKind::applied, EventKind::audit};

analysis::TimeWindow window_of(Window window) {
  return {.from = analysis::Timestamp{window.begin}, .to = analysis::Timestamp{window.end}};
}

analysis::Scope scope_of(int callback, int tid) {
  analysis::Scope scope{.process = analysis::ProcessIndex{0}};
  if (callback != kNone) {
    scope.callback = analysis::CallbackIndex{static_cast<std::uint32_t>(callback)};
  }
  if (tid != kNone) {
    scope.thread = analysis::ThreadIndex{static_cast<std::uint32_t>(tid)};
  }
  return scope;
}

}  // namespace

Facts::Facts(const Recording& recording, bool at_home)
    : recording_{&recording},
      at_home_{at_home},
      knowledge_{[cpus = recording.world.cpus](const Hidden& hidden, std::int32_t cpu) {
        return (cpus.at(static_cast<int>(analysis::at(*hidden.scope.thread))) &
                (1U << static_cast<unsigned>(cpu))) != 0;
      }} {
  for (const auto& loss : recording.losses) {
    analysis::Gap gap{.kinds = loss.kinds, .window = window_of({loss.begin, loss.end})};
    if (loss.cpu != kNone) {
      gap.scope.cpu = loss.cpu;
    }
    if (loss.at_most) {
      gap.at_most = *loss.at_most;
    }
    knowledge_.add(gap);
  }
  if (const auto ends = of(EventKind::process_exit); !ends.empty()) {
    run_end_ = ends.front();
  }
  expect_announcements();
  knowledge_.settle();
  if (run_end_ != nullptr &&
      run_end_->life == static_cast<int>(of(EventKind::announcement).size())) {
    discharge(EventKind::announcement, {0, kForever}, kNone, kNone);
  }
  for (int tid = 0; tid < kThreads; ++tid) {
    discharge_exits(tid);
    discharge_reads(tid);
  }
  for (int c = 0; c < kCallbacks; ++c) {
    discharge_runs(c);
  }
  discharge_ends_and_registrations();
  knowledge_.settle();
}

std::vector<const Event*> Facts::of(EventKinds kinds, Of of) const {
  std::vector<const Event*> found;
  for (const auto& event : recording_->events) {
    if (kinds.has(event.kind) && of.after < event.time && event.time < of.before &&
        (of.callback == kNone || of.callback == event.callback) &&
        (of.tid == kNone || of.tid == event.tid)) {
      found.push_back(&event);
    }
  }
  return found;
}

Hidden Facts::hidden(EventKinds kinds, Window window, int callback, int tid, bool is_unnumbered) {
  return {.kinds = kinds,
          .scope = scope_of(callback, tid),
          .window = window_of(window),
          .is_unnumbered = is_unnumbered};
}

void Facts::discharge(EventKinds kinds, Window window, int callback, int tid) {
  knowledge_.discharge(kinds, scope_of(callback, tid), window_of(window));
}

bool Facts::is_seen(int callback) const {
  return std::any_of(recording_->events.begin(), recording_->events.end(),
                     [&](const Event& event) { return event.callback == callback; });
}

// A thread is on and off by turns: what is missing between two marks that are alike was hidden.
void Facts::expect_announcements() {
  for (int tid = 0; tid < kThreads; ++tid) {
    bool is_on = false;
    int last = -1;
    for (const auto* mark : of(kThreadMarks, {.tid = tid})) {
      const auto window = between(last, mark->time);
      if (mark->kind == EventKind::announcement && is_on) {
        knowledge_.expect(of_thread(EventKind::thread_exit, window, tid));
      } else if (mark->kind != EventKind::announcement && !is_on) {
        knowledge_.expect(of_thread(EventKind::announcement, window, tid));
      }
      is_on = mark->kind != EventKind::thread_exit;
      last = mark->time;
    }
  }
}

// Between an announcement and an exit there is no exit without an announcement, and the other way round.
void Facts::discharge_exits(int tid) {
  const auto marks = of(kThreadMarks, {.tid = tid});
  for (std::size_t i = 0; i <= marks.size(); ++i) {
    const auto* a = i == 0 ? nullptr : marks[i - 1];
    const auto* b = i == marks.size() ? nullptr : marks[i];
    const Window window{a != nullptr ? a->time : -1, b != nullptr ? b->time : kForever};
    const bool is_on = a != nullptr && a->kind != EventKind::thread_exit;
    const bool is_on_then = b != nullptr && b->kind != EventKind::announcement;
    const auto exit = of_thread(EventKind::thread_exit, window, tid);
    const auto announcement = of_thread(EventKind::announcement, window, tid);
    if (b != nullptr && is_on == is_on_then &&
        knowledge_.gap(Conjunction{exit, announcement}) == nullptr) {
      discharge({EventKind::thread_exit, EventKind::announcement}, window, kNone, tid);
    }
    if (!is_on && !is_on_then) {  // what is read then is of a spin that nobody saw
      discharge(kReadBacks, window, kNone, tid);
    }
    if (!is_on && knowledge_.gap(Conjunction{announcement}) == nullptr) {
      discharge(EventKind::thread_exit, window, kNone, tid);
    }
  }
}

// Numbers prove within one spin, so only where no other one, with as many read-backs as the next number says, is hidden.
void Facts::discharge_reads(int tid) {
  std::optional<int> last;
  int number = 0;
  for (const auto* mark : of(kThreadMarks, {.tid = tid})) {
    if (mark->kind != EventKind::announcement && last) {
      const auto window = between(*last, mark->time);
      auto another_spin = Conjunction{of_thread(EventKind::thread_exit, window, tid),
                                      of_thread(EventKind::announcement, window, tid)};
      another_spin.insert(another_spin.end(), static_cast<std::size_t>(std::min(mark->n, 2)),
                          of_thread(EventKind::applied, window, tid, true));
      if (mark->n == number && knowledge_.gap(another_spin) == nullptr) {
        discharge(kReadBacks, {*last, mark->time}, kNone, tid);
      }
      for (int lost = number; lost < mark->n; ++lost) {
        knowledge_.expect(of_thread(kReadBacks, window, tid));
      }
    }
    last = mark->kind == EventKind::thread_exit ? std::nullopt : std::optional{mark->time};
    number = mark->kind == EventKind::applied || mark->kind == EventKind::audit ? mark->n + 1 : 0;
  }
}

// Numbers show how many runs are hidden where. Those whose end is seen are judged, and others are lost.
void Facts::discharge_runs(int callback) {
  struct Mark {
    int time;
    int before;  // runs by then
    int behind;
  };
  std::map<int, const Event*> starts;
  std::map<int, const Event*> ends;
  std::vector<Mark> marks{{-1, 0, 0}};
  int last = 0;
  for (const auto* event :
       of({EventKind::run_start, EventKind::registration, EventKind::callback_exit},
          {.callback = callback})) {
    const bool starts_run = event->kind == EventKind::run_start;
    if (starts_run) {
      starts.emplace(event->n, event);
    }
    marks.push_back({event->time, event->n, event->n + (starts_run ? 1 : 0)});
    last = std::max(last, marks.back().behind);
  }
  for (const auto* event : of(EventKind::run_end, {.callback = callback})) {
    ends.emplace(event->n, event);
    last = std::max(last, event->n + 1);
  }
  for (int seq = 0; seq < last; ++seq) {
    int since = -1;
    int until = kForever;
    for (const auto& mark : marks) {
      since = mark.behind <= seq ? std::max(since, mark.time) : since;
      until = mark.before > 0 && mark.before - 1 >= seq ? std::min(until, mark.time) : until;
    }
    for (const auto* shown : {&starts, &ends}) {
      for (const auto& [number, event] : *shown) {
        until = number >= seq ? std::min(until, event->time) : until;
      }
    }
    const auto* start = starts.contains(seq) ? starts.at(seq) : nullptr;
    const auto* end = ends.contains(seq) ? ends.at(seq) : nullptr;
    if (start == nullptr) {
      knowledge_.expect(of_callback(EventKind::run_start, between(since, until), callback));
    }
    if (start != nullptr || end != nullptr) {
      Instance instance{.callback = callback,
                        .seq = seq,
                        .tid = start != nullptr ? start->tid : end->tid,
                        .start = start,
                        .end = end};
      if (start != nullptr) {
        instance.since = instance.until = start->time;
      } else {
        const auto bounds =
            knowledge_.bounds(of_thread(EventKind::run_start, between(since, until), instance.tid));
        instance.since = static_cast<int>(bounds.from.ns);
        instance.until = static_cast<int>(bounds.to.ns);
      }
      instances_.at(callback).push_back(instance);
    }
  }
  for (std::size_t i = 0; i + 1 < marks.size(); ++i) {
    bool all_ended = true;
    for (int seq = marks[i].behind; seq < marks[i + 1].before; ++seq) {
      all_ended = all_ended && ends.contains(seq);
    }
    if (all_ended) {
      discharge(EventKind::run_start, {marks[i].time, marks[i + 1].time}, callback, kNone);
    }
  }
  for (const auto* fini : of(EventKind::callback_exit, {.callback = callback})) {
    discharge(EventKind::callback_exit, {0, kForever}, callback, kNone);
    discharge({EventKind::run_start, EventKind::run_end, EventKind::registration},
              {fini->time, kForever}, callback, kNone);
    if (fini->ended == static_cast<int>(ends.size())) {
      discharge(EventKind::run_end, {0, kForever}, callback, kNone);
    }
  }
}

void Facts::discharge_ends_and_registrations() {
  int seen = 0;
  for (int c = 0; c < kCallbacks; ++c) {
    seen += is_seen(c) ? 1 : 0;
  }
  if (run_end_ != nullptr) {
    discharge(analysis::kStateKinds | analysis::kRunKinds, {run_end_->time, kForever}, kNone,
              kNone);
  }
  for (int c = 0; c < kCallbacks; ++c) {
    if (!is_seen(c)) {
      if (run_end_ != nullptr && run_end_->n == seen) {
        discharge(EventKind::registration, {0, kForever}, c, kNone);
      }
      continue;
    }
    if (run_end_ != nullptr && of(EventKind::callback_exit, {.callback = c}).empty()) {
      knowledge_.expect(of_callback(EventKind::callback_exit, life(), c));
    }
    const auto* first = of(analysis::kStateKinds | analysis::kRunKinds, {.callback = c}).front();
    if (first->kind != EventKind::registration) {
      knowledge_.expect(of_callback(EventKind::registration, between(-1, first->time), c));
    }
  }
}

int Facts::life_of(int tid, int time) const {
  const auto announced = of(EventKind::announcement, {.tid = tid, .before = time});
  return announced.empty() ? kNone : announced.back()->life;
}

std::optional<int> Facts::off_since(int tid, int time) const {
  const auto marks = of(kThreadMarks, {.tid = tid, .before = time});
  if (marks.empty()) {
    return -1;
  }
  return marks.back()->kind == EventKind::thread_exit ? std::optional{marks.back()->time}
                                                      : std::nullopt;
}

std::optional<Conjunction> Facts::lost_run(int callback, int tid, Window window) const {
  const auto home = world().homes.at(callback);
  if (at_home_ && home != 0 && (home & (1U << static_cast<unsigned>(tid))) == 0) {
    return std::nullopt;
  }
  const Window within{std::max(window.begin, life().begin), std::min(window.end, life().end)};
  Conjunction run{hidden(EventKind::run_start, within, callback, tid)};
  if (!is_seen(callback)) {
    run.push_back(of_callback(EventKind::registration, {0, window.end}, callback));
  }
  return run;
}

std::vector<Conjunction> Facts::lost_runs(int callback) const {
  std::vector<Conjunction> found;
  for (int tid = 0; tid < kThreads; ++tid) {
    if (auto run = lost_run(callback, tid, life())) {
      found.push_back(*std::move(run));
    }
  }
  return found;
}

Conjunction Facts::replaced(int tid, int begin, int end) const {
  const auto off = off_since(tid, end);
  const auto again =
      of_thread(EventKind::announcement, between(std::max(begin, off.value_or(begin)), end), tid);
  return off ? Conjunction{again}
             : Conjunction{of_thread(EventKind::thread_exit, between(begin, end), tid), again};
}

int Facts::last_on(int tid, int time) const {
  const auto marks = of({EventKind::announcement, EventKind::applied, EventKind::audit},
                        {.tid = tid, .before = time});
  return marks.empty() ? -1 : marks.back()->time;
}

bool Facts::ends_between(int tid, int begin, int end) const {
  return !of({EventKind::thread_exit, EventKind::announcement},
             {.tid = tid, .after = begin, .before = end})
              .empty() ||
         off_since(tid, end).value_or(-1) >= 0;
}

bool Facts::is_gone(int tid, int ran, int time) const {
  return off_since(tid, time).value_or(-1) >= 0 || life_of(tid, ran) != life_of(tid, time);
}

}  // namespace cie::test::small
