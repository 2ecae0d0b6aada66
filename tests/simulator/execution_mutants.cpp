// Mutants of how instances start and end: E1 to E3.
#include "simulator/mutants.hpp"

#include <algorithm>

namespace cie::sim {
namespace {

using namespace analysis;

// The spec then asks nothing of the callback's times.
void lift_bounds(Case& c, Place place) {
  auto& entry = c.spec.of(name_of(c, place));
  entry = Spec::Entry{.id = entry.id, .parameters = entry.parameters};
}

CallbackFini& totals(Case& c, Place place) {
  return body<CallbackFini>(of_callback<CallbackFini>(c, place));
}

void end_again(Case& c, Place place, int which, std::uint64_t later) {
  auto end = of_callback<CallbackEnd>(c, place, which);
  end.head.time.ns += 1;
  body<CallbackEnd>(end).seq += later;
  insert(c.trace, end);
  ++totals(c, place).ended;
}

void never_end(Case& c, Place place) {
  remove(c.trace, of_callback<CallbackEnd>(c, place, -1));
  --totals(c, place).ended;
}

// A burst of messages for a callback that two threads run at once.
System reentrant() {
  auto system = base_system();
  system.callbacks[A].steps.insert(system.callbacks[A].steps.begin(), Send{0});
  system.callbacks[B].steps = {Compute{{100'000, 120'000}}};
  system.callbacks[B].group = 0;
  system.groups.push_back({.process = 0, .is_reentrant = true});
  std::erase_if(system.servers, [](const Server& server) { return server.callbacks.front() == B; });
  for (int i = 0; i < 2; ++i) {
    system.servers.push_back({.name = "pool",
                              .is_isolated = false,
                              .callbacks = {B},
                              .parameters = system.servers[A].parameters});
    system.servers.back().parameters.cpus.reset();
  }
  system.loads.clear();
  return system;
}

// The same, of which neither releases nor threads are told.
System reentrant_unknown() {
  auto system = reentrant();
  system.callbacks[B].tells_release = false;
  return system;
}

void forget_threads(Case& c, Place place) {
  for (auto& e : c.trace.events) {
    std::visit(
        [&](const auto& body) {
          if constexpr (requires { body.seq, body.callback; }) {
            if (body.callback == id_of(c, place)) e.head.tid.reset();
          }
        },
        e.body);
  }
  lift_bounds(c, place);
  c.spec.chains.clear();
}

// Instance `which` starts just before the one before it ends.
void overlap(Case& c, Place place, int which) {
  const auto end = of_callback<CallbackEnd>(c, place, which - 1).head;
  auto& start = of_callback<CallbackStart>(c, place, which);
  start.head.time.ns = end.time.ns - 1;
  start.head.cpu = end.cpu;
  body<CallbackStart>(start).release_ns = end.time.ns - 1;
  sort_by_time(c.trace);
  lift_bounds(c, place);
}

// An instance of `inner` runs, on the thread of `outer`, inside an instance of it.
void nest(Case& c, Place inner, Place outer) {
  constexpr int kWhich = 3;
  const auto before = of_callback<CallbackEnd>(c, inner, kWhich - 1).head.time;
  int which = 0;
  while (of_callback<CallbackStart>(c, outer, which).head.time <= before)
    ++which;
  const auto outside = of_callback<CallbackStart>(c, outer, which).head;
  const auto after = of_callback<CallbackEnd>(c, outer, which).head;
  auto& start = of_callback<CallbackStart>(c, inner, kWhich);
  body<CallbackStart>(start).release_ns = outside.time.ns;
  start.head = outside;
  start.head.time.ns += 1;
  auto& end = of_callback<CallbackEnd>(c, inner, kWhich);
  end.head = after;
  end.head.time.ns -= 1;
  sort_by_time(c.trace);
  lift_bounds(c, inner);
  lift_bounds(c, outer);
}

System on_one_thread() {
  auto system = base_system();
  system.servers[D].is_isolated = false;
  system.servers[D].callbacks = {D, F};
  std::erase_if(system.servers, [](const Server& server) { return server.callbacks.front() == F; });
  return system;
}

}  // namespace

std::vector<Mutant> execution_mutants() {
  return {
      {"E1",
       "an instance that never ends",
       {},
       [](Case& c) {
         never_end(c, F);
         lift_bounds(c, F);
       },
       {"E1"},
       {}},
      {"E1", "an instance that ends twice", {}, [](Case& c) { end_again(c, F, 2, 0); }, {"E1"}, {}},
      {"E1", "an end beyond the total", {}, [](Case& c) { end_again(c, F, -1, 5); }, {"E1"}, {}},
      {"E2",
       "a reentrant callback on two threads",
       reentrant,
       [](Case& c) { c.spec.chains.clear(); },
       {"E2", "M3", "R1"},
       {},
       false},
      {"E2",
       "a reentrant callback, threads and releases unknown",
       reentrant_unknown,
       [](Case& c) { forget_threads(c, B); },
       {"E2"},
       {"T5", "M2", "M3", "M4", "M6", "M9", "E3", "R1"},
       false},
      {"E2",
       "an instance that starts within the one before",
       {},
       [](Case& c) { overlap(c, F, 3); },
       {"E2", "E3", "R1"},
       {}},
      {"E3",
       "another's instance inside one, on its thread",
       {},
       [](Case& c) { nest(c, F, D); },
       {"E3", "M2", "M3", "M6"},
       {}},
      {"E3",
       "two callbacks of one thread, one inside the other",
       on_one_thread,
       [](Case& c) { nest(c, F, D); },
       {"E3", "M2"},
       {}},
      {"E3",
       "an instance that starts within the one before",
       {},
       [](Case& c) { overlap(c, D, 4); },
       {"E2", "E3", "R1"},
       {}},
  };
}

}  // namespace cie::sim
