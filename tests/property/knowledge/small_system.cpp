#include "small_system.hpp"

#include <algorithm>
#include <utility>

namespace cie::test::small {
namespace {

constexpr EventKinds kReads{EventKind::applied, EventKind::audit};

unsigned bit(int number) { return 1U << static_cast<unsigned>(number); }

bool is_open_on(const State& state, int tid) {
  return std::any_of(state.open.begin(), state.open.end(),
                     [&](const Run& run) { return run.tid == tid; });
}

int life_of(const Thread& thread) { return thread.life == kNone ? kUnannounced : thread.life; }

// A thread and which life of it, as one number that is not 0.
int place_of(const State& state, int tid) {
  constexpr int kLives = 100'000;
  return 1 + tid * kLives + (life_of(state.threads.at(tid)) - kUnannounced);
}

bool lives(const State& state, int place) {
  constexpr int kLives = 100'000;
  const int tid = (place - 1) / kLives;
  const auto& thread = state.threads.at(tid);
  return place_of(state, tid) == place && (thread.is_on || thread.life < 0);
}

// A callback went on on another thread: while the one before lived, or after it had ended.
unsigned moved(const State& state, Memory& memory, const Event& event, bool is_former_alive) {
  if (event.kind != EventKind::run_start) {
    return 0;
  }
  const int before = std::exchange(memory.at(event.callback), place_of(state, event.tid));
  return before != 0 && before != memory.at(event.callback) &&
                 lives(state, before) == is_former_alive
             ? bit(event.callback)
             : 0;
}

unsigned changed(const State& state, const Event& event) {
  const auto& thread = state.threads.at(event.tid);
  const bool inherits = event.kind == EventKind::context_switch && thread.is_boosted;
  return thread.applied != kNone && thread.applied != event.value && !inherits ? bit(event.tid) : 0;
}

// Not what any rule forbids.
bool is_sane(const State& state, const Event& event) {
  switch (event.kind) {
    case EventKind::run_start:
      return event.tid == event.callback % kThreads && !is_open_on(state, event.tid) &&
             state.threads.at(event.tid).is_on && event.value == 0;
    case EventKind::registration:
      return state.registered.at(event.callback) == 0 && event.callback < 2;
    case EventKind::applied:
    case EventKind::audit:
    case EventKind::context_switch:
      return event.value == kAsSpecified;
    case EventKind::priority_inheritance:
      return event.value == kAsSpecified;
    default:
      return true;
  }
}

double weight(EventKind kind) {
  switch (kind) {
    case EventKind::announcement:
      return 4;
    case EventKind::run_start:
      return 8;
    case EventKind::run_end:
      return 9;
    case EventKind::callback_exit:
      return 0.3;
    case EventKind::context_switch:
      return 2;
    case EventKind::priority_inheritance:
      return 0.7;
    default:
      return 1;
  }
}

}  // namespace

int below(Random& random, int bound) {
  return static_cast<int>(random() % static_cast<std::uint64_t>(bound));
}
double share(Random& random) { return std::uniform_real_distribution<double>{}(random); }

std::string name_of(Rule rule) {
  constexpr std::array names{"M2", "M3", "M4", "M7", "M9", "S1", "S3", "S3 by read-back",
                             "E2", "E3", "R2", "R3"};
  return names.at(static_cast<std::size_t>(rule));
}

bool is_of_threads(Rule rule) {
  return rule == Rule::m2 || rule == Rule::m9 || rule == Rule::s1 || rule == Rule::s3 ||
         rule == Rule::s3_by_read_back || rule == Rule::e3;
}

int State::callbacks() const {
  return static_cast<int>(
      std::count_if(registered.begin(), registered.end(), [](int r) { return r > 0; }));
}

std::optional<State> State::after(const World& world, const Event& event) const {
  const int c = event.callback;
  const int t = event.tid;
  if (is_over || (t != kNone && event.kind != EventKind::priority_inheritance &&
                  (world.cpus.at(t) & bit(event.cpu)) == 0)) {
    return std::nullopt;
  }
  auto next = *this;
  switch (event.kind) {
    case EventKind::registration:  // again: the same callback is given to another thread
      if (registered.at(c) == 2 || event.n != seqs.at(c)) {
        return std::nullopt;
      }
      next.registered.at(c) = 1;
      return next;
    case EventKind::callback_exit:
      if (registered.at(c) != 1 || event.n != seqs.at(c) || event.ended != ended.at(c)) {
        return std::nullopt;
      }
      next.registered.at(c) = 2;
      return next;
    case EventKind::run_start: {
      if (registered.at(c) != 1 || event.n != seqs.at(c)) {
        return std::nullopt;
      }
      auto& thread = next.threads.at(t);
      thread.life = thread.life == kNone ? kUnannounced : thread.life;
      next.seqs.at(c) = event.n + 1;
      const Run run{.callback = c, .seq = event.n, .tid = t, .release = event.release};
      next.open.insert(std::upper_bound(next.open.begin(), next.open.end(), run), run);
      return next;
    }
    case EventKind::run_end: {
      const auto run = std::find_if(next.open.begin(), next.open.end(), [&](const Run& open_run) {
        return open_run.callback == c && open_run.seq == event.n && open_run.tid == t;
      });
      if (run == next.open.end() || registered.at(c) == 2) {
        return std::nullopt;
      }
      next.open.erase(run);
      ++next.ended.at(c);
      return next;
    }
    case EventKind::announcement: {  // of another life: a new thread; of the same: it spins again
      auto& thread = next.threads.at(t);
      if (thread.is_on || is_open_on(*this, t)) {
        return std::nullopt;
      }
      const bool is_boosted = thread.life == event.life && thread.is_boosted;
      thread = {.life = event.life, .is_on = true, .is_boosted = is_boosted};
      ++next.announced;
      return next;
    }
    case EventKind::thread_exit: {
      auto& thread = next.threads.at(t);
      if (!thread.is_on || event.n != thread.reads || is_open_on(*this, t)) {
        return std::nullopt;
      }
      thread.is_on = false;
      return next;
    }
    case EventKind::applied:
    case EventKind::audit: {
      auto& thread = next.threads.at(t);
      if (!thread.is_on || event.n != thread.reads) {
        return std::nullopt;
      }
      ++thread.reads;
      thread.applied = event.kind == EventKind::applied ? event.value : thread.applied;
      return next;
    }
    case EventKind::process_exit: {  // everything ended before, but for what hangs
      for (int other = 0; other < kThreads; ++other) {
        if (threads.at(other).is_on && !is_open_on(*this, other)) {
          return std::nullopt;
        }
      }
      if (std::count(registered.begin(), registered.end(), 1) > 0 || event.n != callbacks() ||
          event.life != announced) {
        return std::nullopt;
      }
      next.is_over = true;
      return next;
    }
    case EventKind::context_switch:
      return threads.at(t).life == kNone ? std::nullopt : std::optional{next};
    case EventKind::priority_inheritance:
      if (threads.at(t).is_boosted == (event.value != 0)) {
        return std::nullopt;
      }
      next.threads.at(t).is_boosted = event.value != 0;
      return next;
    default:
      return std::nullopt;
  }
}

std::vector<Event> State::possible(const World& world, int time, int cpu, Rule rule,
                                   bool at_home) const {
  std::vector<Event> found;
  const auto add = [&](Event event) {
    event.time = time;
    event.cpu = cpu;
    found.push_back(event);
  };
  const bool looks_at_values =
      rule == Rule::s1 || rule == Rule::s3 || rule == Rule::s3_by_read_back;
  for (int c = 0; c < kCallbacks; ++c) {
    add({.kind = EventKind::registration, .callback = c, .n = seqs.at(c)});
    add({.kind = EventKind::callback_exit, .callback = c, .n = seqs.at(c), .ended = ended.at(c)});
  }
  for (int t = 0; t < kThreads; ++t) {
    const auto& thread = threads.at(t);
    add({.kind = EventKind::announcement, .tid = t, .life = announced});
    if (thread.life >= 0 && thread.life != announced) {
      add({.kind = EventKind::announcement, .tid = t, .life = thread.life});
    }
    add({.kind = EventKind::thread_exit, .tid = t, .n = thread.reads});
    for (int value = kAsSpecified; value <= (looks_at_values ? kOtherwise : kAsSpecified);
         ++value) {
      add({.kind = EventKind::applied, .tid = t, .n = thread.reads, .value = value});
      add({.kind = EventKind::audit, .tid = t, .n = thread.reads, .value = value});
      add({.kind = EventKind::context_switch, .tid = t, .value = value});
    }
    add({.kind = EventKind::priority_inheritance, .tid = t, .value = thread.is_boosted ? 0 : 1});
    for (int c = 0; c < kCallbacks; ++c) {
      if (at_home && world.homes.at(c) != 0 && (world.homes.at(c) & bit(t)) == 0) {
        continue;
      }
      for (int missed = 0; missed <= (rule == Rule::r2 ? 1 : 0); ++missed) {
        for (int wait = 0; wait <= (rule == Rule::r3 ? kDeadline : 0); wait += kDeadline) {
          add({.kind = EventKind::run_start,
               .callback = c,
               .tid = t,
               .n = seqs.at(c),
               .value = missed,
               .release = time - wait});
        }
      }
    }
  }
  for (const auto& run : open) {
    add({.kind = EventKind::run_end, .callback = run.callback, .tid = run.tid, .n = run.seq});
  }
  add({.kind = EventKind::process_exit, .n = callbacks(), .life = announced});
  return found;
}

unsigned violated(Rule rule, const World& world, Memory& memory, const State& state,
                  const Event& event) {
  const bool starts = event.kind == EventKind::run_start;
  switch (rule) {
    case Rule::m2:  // a thread incarnation ran two callbacks
      if (event.kind == EventKind::announcement && state.threads.at(event.tid).life != event.life) {
        memory.at(event.tid) = 0;
      }
      if (!starts) {
        return 0;
      }
      memory.at(event.tid) |= static_cast<int>(bit(event.callback));
      return (memory.at(event.tid) & (memory.at(event.tid) - 1)) != 0 ? bit(event.tid) : 0;
    case Rule::m3:
      return moved(state, memory, event, true);
    case Rule::m4:
      if (event.kind == EventKind::registration) {
        memory.at(event.callback) = 0;
      }
      return moved(state, memory, event, false);
    case Rule::m7: {  // two callbacks of one logical id live
      if (event.kind != EventKind::registration) {
        return 0;
      }
      for (int c = 0; c < kCallbacks; ++c) {
        if (c != event.callback && state.registered.at(c) == 1 &&
            world.ids.at(c) == world.ids.at(event.callback)) {
          return bit(world.ids.at(c) - 'a');
        }
      }
      return 0;
    }
    case Rule::m9:
      return starts && !state.threads.at(event.tid).is_on ? bit(event.tid) : 0;
    case Rule::s1:  // started with other parameters than the spec's, once it had these
      if (event.kind == EventKind::announcement) {
        memory.at(event.tid) = 0;
      }
      if (event.kind == EventKind::applied && event.value == kAsSpecified) {
        memory.at(event.tid) = 1;
      }
      return starts && memory.at(event.tid) != 0 &&
                     state.threads.at(event.tid).applied != kAsSpecified
                 ? bit(event.tid)
                 : 0;
    case Rule::s3:
      return event.kind == EventKind::audit || event.kind == EventKind::context_switch
                 ? changed(state, event)
                 : 0;
    case Rule::s3_by_read_back:
      return event.kind == EventKind::audit ? changed(state, event) : 0;
    case Rule::e2:
      return starts && std::any_of(state.open.begin(), state.open.end(),
                                   [&](const Run& run) { return run.callback == event.callback; })
                 ? bit(event.callback)
                 : 0;
    case Rule::e3:
      return starts && std::any_of(state.open.begin(), state.open.end(),
                                   [&](const Run& run) {
                                     return run.tid == event.tid && run.callback != event.callback;
                                   })
                 ? bit(event.tid)
                 : 0;
    case Rule::r2:
      if (!starts) {
        return 0;
      }
      memory.at(event.callback) = std::min(memory.at(event.callback) + event.value, kAllowed + 1);
      return memory.at(event.callback) > kAllowed ? bit(event.callback) : 0;
    case Rule::r3: {  // open, or ends, later than the deadline, as any event of its process shows
      unsigned late = 0;
      for (const auto& run : state.open) {
        if (!analysis::kKernelKinds.has(event.kind) && event.time - run.release > kDeadline) {
          late |= bit(run.callback);
        }
      }
      return late;
    }
  }
  return 0;
}

std::vector<int> subjects(const Recording& recording, Rule rule) {
  std::vector<int> found;
  for (const auto& event : recording.events) {
    if (rule == Rule::m7) {
      if (event.kind == EventKind::registration) {
        found.push_back(recording.world.ids.at(event.callback) - 'a');
      }
    } else if (const int subject = is_of_threads(rule) ? event.tid : event.callback;
               subject != kNone) {
      found.push_back(subject);
    }
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

Execution random_execution(const World& world, Random& random, bool has_kernel) {
  Execution made;
  State state;
  const bool ends_in_order = share(random) < 0.6;
  const double wild = share(random) * 0.4;
  const auto happen = [&](const Event& event) {
    state = *state.after(world, event);
    made.events.push_back(event);
  };
  for (int time = kPace; time < kTicks; time += kPace) {
    std::vector<Event> all;
    std::vector<Event> sane;
    const auto of_rule = below(random, 2) == 0 ? Rule::r2 : Rule::r3;
    for (int cpu = 0; cpu < kCpus; ++cpu) {
      for (const auto rule : {Rule::s3, of_rule}) {
        for (const auto& event : state.possible(world, time, cpu, rule, false)) {
          if (event.kind == EventKind::process_exit || !state.after(world, event) ||
              (!has_kernel && analysis::kKernelKinds.has(event.kind))) {
            continue;
          }
          all.push_back(event);
          if (is_sane(state, event)) {
            sane.push_back(event);
          }
        }
      }
    }
    const auto& pool = !sane.empty() && share(random) > wild ? sane : all;
    if (pool.empty() || share(random) < 0.1) {
      continue;
    }
    std::vector<double> weights;
    for (const auto& event : pool) {
      weights.push_back(weight(event.kind));
    }
    auto event =
        pool.at(std::discrete_distribution<std::size_t>{weights.begin(), weights.end()}(random));
    if (event.kind == EventKind::announcement && event.life == state.announced) {
      event.life = 1000 + time;  // as no hidden one has
    }
    happen(event);
  }
  made.end = kTicks;
  while (ends_in_order) {  // an instance may never end
    std::optional<Event> first;
    double first_order = 9;
    for (int cpu = 0; cpu < kCpus; ++cpu) {
      for (const auto& event : state.possible(world, made.end, cpu, Rule::e2, false)) {
        const double order = event.kind == EventKind::run_end       ? (share(random) < 0.9 ? 0 : 9)
                             : event.kind == EventKind::thread_exit ? 1
                             : event.kind == EventKind::callback_exit ? 2
                             : event.kind == EventKind::process_exit  ? 3
                                                                      : 9;
        if (order < 9 && state.after(world, event) && order + share(random) < first_order) {
          first = event;
          first_order = order + share(random) / 2;
        }
      }
    }
    if (!first) {
      break;
    }
    happen(*first);
    made.end += kPace;
  }
  return made;
}

int lose(std::vector<Event>& events, const Loss& loss, Random& random, double taken) {
  const auto size = events.size();
  std::erase_if(events, [&](const Event& event) {
    return loss.kinds.has(event.kind) && loss.begin <= event.time && event.time <= loss.end &&
           (loss.cpu == kNone || loss.cpu == event.cpu) && share(random) <= taken;
  });
  return static_cast<int>(size - events.size());
}

Per<unsigned, kCallbacks> homes(const std::vector<Event>& events) {
  Per<unsigned, kCallbacks> found{};
  for (const auto& event : events) {
    if (event.kind == EventKind::run_start || event.kind == EventKind::run_end) {
      found.at(event.callback) |= bit(event.tid);
    }
  }
  return found;
}

std::string text_of(const Event& event) {
  constexpr std::array names{"register", "announce", "applied", "audit",  "exit",
                             "fini",     "run_end",  "start",   "end",    "release",
                             "publish",  "lost",     "switch",  "wakeup", "boost"};
  std::string text = std::to_string(event.time) + "@" + std::to_string(event.cpu) + " " +
                     names.at(static_cast<std::size_t>(event.kind));
  const auto add = [&](const char* name, int value) {
    text += std::string{" "} + name + std::to_string(value);
  };
  if (event.callback != kNone) {
    add("c", event.callback);
  }
  if (event.tid != kNone) {
    add("t", event.tid);
  }
  add("#", event.n);
  if (event.value != 0) {
    add("=", event.value);
  }
  if (event.life != kNone) {
    add("life ", event.life);
  }
  return text;
}

}  // namespace cie::test::small
