// Mutants of which callbacks run where: M1 to M9.
#include "simulator/mutants.hpp"
#include "simulator/transform.hpp"

#include <algorithm>

namespace cie::sim {
namespace {

using namespace analysis;

constexpr auto kAny = [](const auto&, const auto&) { return true; };

// Callbacks of isolated threads of the base, on threads that they share instead.
std::function<System()> pooled(std::vector<int> callbacks, int threads) {
  return [callbacks, threads] {
    auto system = base_system();
    Server pool{.name = "pool", .process = 0, .is_isolated = false, .callbacks = callbacks};
    pool.parameters = system.servers[F].parameters;
    std::erase_if(system.servers, [&callbacks](const Server& server) {
      return std::ranges::find(callbacks, server.callbacks.front()) != callbacks.end();
    });
    for (int i = 0; i < threads; ++i)
      system.servers.push_back(pool);
    return system;
  };
}

// One isolated thread, announced for a group of two callbacks.
System grouped() {
  auto system = base_system();
  system.groups.push_back({.process = 0, .is_reentrant = false});
  system.callbacks[D].group = system.callbacks[F].group = 0;
  system.servers[D].callbacks = {D, F};
  std::erase_if(system.servers, [](const Server& server) { return server.callbacks.front() == F; });
  return system;
}

// An instance whose thread ran throughout.
const InstanceTruth& undisturbed(const Case& c, Place place) {
  return *std::ranges::find_if(c.truth.instances, [place](const InstanceTruth& instance) {
    return instance.callback == static_cast<int>(place) && instance.seq > 1 &&
           instance.parts.execution == *instance.end - instance.start;
  });
}

void move_instance(Case& c, Place place, Place to) {
  const auto seq = undisturbed(c, place).seq;
  const auto is_it = [&](const auto& body, const EventHead&) {
    return body.callback == id_of(c, place) && body.seq == seq;
  };
  event<CallbackStart>(c.trace, is_it).head.tid = tid_of(c, to);
  event<CallbackEnd>(c.trace, is_it).head.tid = tid_of(c, to);
}

void set_tid(Event& e, std::int64_t from, std::int64_t to) {
  const auto replace = [&](auto& tid) {
    if (static_cast<std::int64_t>(tid) == from) tid = static_cast<std::decay_t<decltype(tid)>>(to);
  };
  if (e.head.tid == from) e.head.tid = to;
  std::visit(
      [&replace](auto& body) {
        if constexpr (requires { body.prev_tid; }) {
          replace(body.prev_tid);
          replace(body.next_tid);
        } else if constexpr (requires { body.tid; }) {
          replace(body.tid);
        }
      },
      e.body);
}

// The callback's thread ends in between, and another one, with its tid or a new one, goes on.
void replace_thread(Case& c, Place place, bool is_tid_reused) {
  const auto old_tid = tid_of(c, place);
  const auto new_tid = is_tid_reused ? old_tid : old_tid + 5'000;
  auto time = quiet_time(c);
  for (auto& e : c.trace.events) {
    if (e.head.time.ns > time) set_tid(e, old_tid, new_tid);
  }
  auto fini = event<ThreadFini>(c.trace, [&](const ThreadFini& end, const EventHead&) {
    return end.tid == static_cast<std::uint32_t>(new_tid);
  });
  auto init = announcement(c, old_tid);
  auto initial = read_back(c, old_tid, SchedMoment::initial);
  auto applied = read_back(c, old_tid, SchedMoment::applied);
  set_tid(fini, new_tid, old_tid);
  body<ThreadFini>(fini).read_backs = 2;
  body<ThreadInit>(init).start_ns = time + 1;
  for (auto* e : {&fini, &init, &initial, &applied}) {
    if (e != &fini) set_tid(*e, old_tid, new_tid);
    e->head.time.ns = time++;
    e->head.cpu.reset();  // the kernel's switches show other threads there
    insert(c.trace, *e);
  }
  ++body<RunEnd>(event<RunEnd>(c.trace, kAny)).threads;
  c.spec.of(name_of(c, place)).foreign_work_budget.reset();  // its thread's time has a gap
}

// The whole run once more, as another process, later.
void restart(Case& c) {
  const auto span = c.trace.events.back().head.time.ns - kBeginning;
  c.trace =
      merged(c.trace, changed(c.trace, {.time = span + 1'000'000, .pid = 3'000, .writer = 500}));
}

template <typename ChangeInit>
std::function<void(Case&)> restarted(Place place, ChangeInit change) {
  return [place, change](Case& c) {
    restart(c);
    change(body<CallbackInit>(of_callback<CallbackInit>(c, place, -1)));
  };
}

void remove_thread_events(Case& c, Place place) {
  const auto tid = static_cast<std::uint32_t>(tid_of(c, place));
  const auto is_of_it = [tid](const auto& body, const EventHead&) { return body.tid == tid; };
  c.trace.erase<ThreadInit>(is_of_it);
  c.trace.erase<ThreadSched>(is_of_it);
  c.trace.erase<ThreadFini>(is_of_it);
  --body<RunEnd>(event<RunEnd>(c.trace, kAny)).threads;
}

// The thread says that its work for callbacks ends, and its callback goes on there.
void end_thread_early(Case& c, Place place) {
  const auto tid = static_cast<std::uint32_t>(tid_of(c, place));
  const auto time = quiet_time(c);
  const auto is_of_it = [tid](const auto& body, const EventHead&) { return body.tid == tid; };
  auto fini = event<ThreadFini>(c.trace, is_of_it);
  c.trace.erase<ThreadFini>(is_of_it);
  const auto later =
      c.trace.erase<ThreadSched>([&](const ThreadSched& read, const EventHead& head) {
        return read.tid == tid && head.time.ns >= time;
      });
  fini.head.time.ns = time;
  body<ThreadFini>(fini).read_backs -= static_cast<std::uint32_t>(later);
  insert(c.trace, fini);
  c.spec.of(name_of(c, place)).foreign_work_budget.reset();  // its work goes on
}

// Nothing of the callback was recorded; the totals of its process still count it.
void lose_callback(Case& c, Place place) {
  const auto id = id_of(c, place);
  const auto is_of_it = [id](const auto& body, const EventHead&) { return body.callback == id; };
  c.trace.erase<CallbackInit>(is_of_it);
  c.trace.erase<CallbackFini>(is_of_it);
  c.trace.erase<CallbackStart>(is_of_it);
  c.trace.erase<CallbackEnd>(is_of_it);
  c.trace.erase<CallbackRelease>(is_of_it);
}

void never_run(Case& c, Place place) {
  const auto is_of_it = [&](const auto& body, const EventHead&) {
    return body.callback == id_of(c, place);
  };
  c.trace.erase<CallbackStart>(is_of_it);
  c.trace.erase<CallbackEnd>(is_of_it);
  auto& totals = body<CallbackFini>(of_callback<CallbackFini>(c, place));
  totals.started = totals.ended = 0;
}

void give_same_id(Case& c, Place place, Place other) {
  auto& ids = c.spec.callbacks;
  std::erase_if(ids, [&](const Spec::Entry& entry) {
    return entry.id == name_of(c, place) || entry.id == name_of(c, other);
  });
  body<CallbackInit>(of_callback<CallbackInit>(c, place)).logical_id =
      body<CallbackInit>(of_callback<CallbackInit>(c, other)).logical_id;
}

void make_reentrant(Case& c, Place place) {
  const auto group = body<CallbackInit>(of_callback<CallbackInit>(c, place)).group;
  body<GroupInit>(event<GroupInit>(c.trace, [group](const GroupInit& init, const EventHead&) {
    return init.group == group;
  })).type = GroupType::reentrant;
}

std::vector<Mutant> specified_callbacks() {
  return {
      {"M1",
       "a callback that does not exist",
       {},
       [](Case& c) { c.spec.callbacks.push_back({.id = "/n0@Ghost"}); },
       {"M1"},
       {}},
      {"M1", "a misspelt id", {}, [](Case& c) { c.spec.of("/n0@F").id = "/n0@f"; }, {"M1"}, {}},
      {"M1", "a callback that never runs", {}, [](Case& c) { never_run(c, F); }, {"M1", "M6"}, {}},
      {"M1",
       "a misspelt member of a chain",
       {},
       [](Case& c) { c.spec.chains.at(0).callbacks.back() = "/n0@c"; },
       {"M1"},
       {"Q2"}},
      {"M1", "a misspelt thread", {}, [](Case& c) { c.spec.of("recv").id = "recw"; }, {"M1"}, {}},
  };
}

std::vector<Mutant> one_to_one() {
  const auto as_it_is = [](Case&) {};
  return {
      {"M2", "two callbacks on a pool's only thread", pooled({D, F}, 1), as_it_is, {"M2"}, {}},
      {"M2", "three callbacks on a pool's only thread", pooled({D, E, F}, 1), as_it_is, {"M2"}, {}},
      {"M2", "a group of two on its own thread", grouped, as_it_is, {"M2", "M8"}, {}},
      {"M2",
       "an instance on another's thread",
       {},
       [](Case& c) { move_instance(c, C, D); },
       {"M2", "M3", "M6"},
       {}},
      {"M3", "a timer on a pool of two threads", pooled({F}, 2), as_it_is, {"M3"}, {}},
      {"M3", "a timer on a pool of three threads", pooled({D}, 3), as_it_is, {"M3"}, {}},
      {"M3", "a subscription on a pool of two threads", pooled({C}, 2), as_it_is, {"M3"}, {}},
      {"M4", "a thread replaced", {}, [](Case& c) { replace_thread(c, F, false); }, {"M4"}, {}},
      {"M4",
       "another thread replaced",
       {},
       [](Case& c) { replace_thread(c, D, false); },
       {"M4"},
       {}},
      {"M4", "a tid reused", {}, [](Case& c) { replace_thread(c, F, true); }, {"M4"}, {}},
  };
}

std::vector<Mutant> after_restart() {
  return {
      {"M5", "(none) restarted as it was", {}, [](Case& c) { restart(c); }, {}, {}},
      {"M5",
       "restarted with another period",
       {},
       restarted(F, [](CallbackInit& init) { init.period_ns += 1; }),
       {"M5"},
       {}},
      {"M5",
       "restarted with another deadline",
       {},
       restarted(D, [](CallbackInit& init) { init.deadline_ns = 1'000'000'000; }),
       {"M5"},
       {}},
      {"M5",
       "restarted on other CPUs",  // of which one has no record of the kernel's
       {},
       [](Case& c) {
         restart(c);
         const auto tid = static_cast<std::uint32_t>(tid_of(c, F) + 3'000);
         for (auto& e : c.trace.events) {
           auto* read = std::get_if<ThreadSched>(&e.body);
           if (read == nullptr || read->tid != tid || read->moment == SchedMoment::initial)
             continue;
           read->cpus = c.trace.cpus->emplace_back(std::vector<std::uint32_t>{0, 1, 2});
         }
       },
       {"M5"},
       {"M6", "R4"}},
  };
}

std::vector<Mutant> owners() {
  return {
      {"M6",
       "more work outside callbacks than allowed",
       {},
       [](Case& c) { --*c.spec.of("/n0@A").foreign_work_budget; },
       {"M6"},
       {}},
      {"M6",
       "more work of the receive thread than allowed",
       {},
       [](Case& c) { --*c.spec.of("recv").foreign_work_budget; },
       {"M6"},
       {}},
      {"M6",
       "threads announced for each other's callback",
       {},
       [](Case& c) {
         body<ThreadInit>(announcement(c, tid_of(c, D))).callback = id_of(c, F);
         body<ThreadInit>(announcement(c, tid_of(c, F))).callback = id_of(c, D);
       },
       {"M6"},
       {}},
      {"M7", "two timers of one id", {}, [](Case& c) { give_same_id(c, F, D); }, {"M7"}, {}},
      {"M7", "two other timers of one id", {}, [](Case& c) { give_same_id(c, F, E); }, {"M7"}, {}},
      {"M7",
       "three timers of one id",
       {},
       [](Case& c) {
         give_same_id(c, F, D);
         give_same_id(c, E, D);
       },
       {"M7"},
       {}},
      {"M7",
       "a callback of which nothing was recorded",
       {},
       [](Case& c) { lose_callback(c, F); },
       {},
       {"T4", "M1", "M2", "M6", "M7", "M8", "M9", "E3"}},
      {"M8", "a reentrant group", {}, [](Case& c) { make_reentrant(c, F); }, {"M8"}, {}},
      {"M8", "another reentrant group", {}, [](Case& c) { make_reentrant(c, B); }, {"M8"}, {}},
      {"M8",
       "a second callback in a group",
       {},
       [](Case& c) {
         body<CallbackInit>(of_callback<CallbackInit>(c, F)).group =
             body<CallbackInit>(of_callback<CallbackInit>(c, D)).group;
       },
       {"M8"},
       {}},
      {"M9",
       "a timer's thread never announced",
       {},
       [](Case& c) { remove_thread_events(c, F); },
       {"M9"},
       {"S4"}},
      {"M9",
       "another timer's thread never announced",
       {},
       [](Case& c) { remove_thread_events(c, D); },
       {"M9"},
       {"S4"}},
      {"M9",
       "a subscription's thread never announced",
       {},
       [](Case& c) { remove_thread_events(c, C); },
       {"M9"},
       {"S4"}},
      {"M9",
       "a timer that goes on after the end of its thread",
       {},
       [](Case& c) { end_thread_early(c, F); },
       {"M4", "M9"},
       {"S4"}},
      {"M9",
       "a subscription that goes on after the end of its thread",
       {},
       [](Case& c) { end_thread_early(c, C); },
       {"M4", "M9"},
       {"S4"}},
  };
}

}  // namespace

std::vector<Mutant> mapping_mutants() {
  std::vector<Mutant> all;
  for (auto& some : {specified_callbacks(), one_to_one(), after_restart(), owners()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace cie::sim
