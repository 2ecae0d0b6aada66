// Mutants of what threads run as: S1 to S5.
#include "simulator/mutants.hpp"

#include <algorithm>
#include <set>

namespace cie::sim {
namespace {

using namespace analysis;

std::span<const std::uint32_t> cpus(Case& c, std::vector<std::uint32_t> list) {
  return c.trace.cpus->emplace_back(std::move(list));
}

// Asks for something else than what a thread runs as.
template <typename ChangeParameters>
std::function<void(Case&)> asking(const char* id, ChangeParameters change) {
  return [id, change](Case& c) { change(*c.spec.of(id).parameters); };
}

std::function<void(Case&)> configured_late(Place place) {
  return [place](Case& c) {
    const auto end = of_callback<CallbackEnd>(c, place, 0).head;
    auto& applied = read_back(c, tid_of(c, place), SchedMoment::applied);
    applied.head.time.ns = end.time.ns + 1;
    applied.head.cpu = end.cpu;
    applied.head.stream = end.stream;
    sort_by_time(c.trace);
  };
}

// Of SCHED_FIFO: it is given SCHED_RR behind its second instance and SCHED_FIFO again behind its fourth.
void run_as_round_robin_meanwhile(Case& c, Place place) {
  const auto tid = tid_of(c, place);
  body<ThreadSched>(read_back(c, tid, SchedMoment::audit)).n += 2;
  const auto is_of_it = [tid](const ThreadFini& fini, const EventHead&) {
    return fini.tid == static_cast<std::uint32_t>(tid);
  };
  body<ThreadFini>(event<ThreadFini>(c.trace, is_of_it)).read_backs += 2;
  const auto applied = read_back(c, tid, SchedMoment::applied);
  const auto give = [&](Policy policy, int behind, std::uint32_t number) {
    auto given = applied;
    given.head = of_callback<CallbackEnd>(c, place, behind).head;
    given.head.time.ns += 1;
    auto& read = body<ThreadSched>(given);
    read.n += number;
    read.policy = static_cast<std::int32_t>(policy);
    insert(c.trace, given);
  };
  give(Policy::round_robin, 1, 1);
  give(Policy::fifo, 3, 2);
}

void renice(Case& c, Place place, std::int32_t prio) {
  const auto tid = tid_of(c, place);
  for (auto& e : c.trace.events) {
    auto* change = std::get_if<SchedSwitch>(&e.body);
    if (change == nullptr || e.head.time.ns < quiet_time(c)) continue;
    if (change->prev_tid == tid) change->prev_prio = prio;
    if (change->next_tid == tid) change->next_prio = prio;
  }
}

// A thread that a real-time one creates, and that runs as it.
void fork_real_time(Case& c, std::int64_t parent) {
  constexpr std::int64_t kChild = 9'999;
  const auto& events = c.trace.events;
  std::size_t first = 0;
  for (std::size_t i = 0; i < events.size() && first == 0; ++i) {
    const auto* to_idle = std::get_if<SchedSwitch>(&events[i].body);
    if (to_idle == nullptr || to_idle->next_tid != 0) continue;
    if (events[i].head.time.ns < kBeginning + 5'000'000) continue;
    const auto next = std::find_if(
        events.begin() + static_cast<std::ptrdiff_t>(i) + 1, events.end(), [&](const Event& e) {
          return e.head.cpu == events[i].head.cpu && std::holds_alternative<SchedSwitch>(e.body);
        });
    if (next != events.end() && next->head.time.ns > events[i].head.time.ns + 1'000) first = i;
  }
  auto e = events.at(first);
  const auto begin = e.head.time.ns;
  const auto idle = body<SchedSwitch>(e);
  e.head.time.ns = begin + 1;
  e.body = SchedProcessFork{.parent_tid = parent, .child_tid = kChild, .child_comm = "child"};
  insert(c.trace, e);
  e.head.time.ns = begin + 100;
  e.body = SchedSwitch{.prev_comm = idle.next_comm,
                       .prev_tid = 0,
                       .prev_prio = 120,
                       .prev_state = 0,
                       .next_comm = "child",
                       .next_tid = kChild,
                       .next_prio = 49};
  insert(c.trace, e);
  e.head.time.ns = begin + 200;
  e.body = SchedSwitch{.prev_comm = "child",
                       .prev_tid = kChild,
                       .prev_prio = 49,
                       .prev_state = 0x80,
                       .next_comm = idle.next_comm,
                       .next_tid = 0,
                       .next_prio = 120};
  insert(c.trace, e);
}

std::function<void(Case&)> begins_as(std::function<std::int64_t(const Case&)> tid, Policy policy) {
  return [tid, policy](Case& c) {
    auto& initial = body<ThreadSched>(read_back(c, tid(c), SchedMoment::initial));
    initial.policy = static_cast<std::int32_t>(policy);
    initial.priority = policy == Policy::deadline ? 0 : 50;
  };
}

std::vector<Mutant> specified_parameters() {
  return {
      {"S1",
       "another priority asked for",
       {},
       asking("/n0@A", [](ThreadParameters& p) { ++p.priority; }),
       {"S1"},
       {}},
      {"S1",
       "another nice value asked for",
       {},
       asking("/n0@D", [](ThreadParameters& p) { p.nice = 1; }),
       {"S1"},
       {}},
      {"S1",
       "other CPUs asked for",
       {},
       asking("/n0@A",
              [](ThreadParameters& p) {
                p.cpus = std::vector<std::uint32_t>{0, 1};
              }),
       {"S1"},
       {}},
      {"S1",
       "another runtime asked for",
       {},
       asking("/n0@E", [](ThreadParameters& p) { ++p.runtime_ns; }),
       {"S1"},
       {}},
      {"S1",
       "another priority of the receive thread asked for",
       {},
       asking("recv", [](ThreadParameters& p) { --p.priority; }),
       {"S1"},
       {}},
      {"S1",
       "another policy while instances ran",
       {},
       [](Case& c) { run_as_round_robin_meanwhile(c, A); },
       {"S1"},
       {}},
      {"S2", "a timer's thread configured late", {}, configured_late(A), {"S2"}, {}},
      {"S2", "a subscription's thread configured late", {}, configured_late(C), {"S2"}, {}},
      {"S2", "a thread of SCHED_OTHER configured late", {}, configured_late(F), {"S2"}, {}},
  };
}

std::vector<Mutant> unchanged() {
  return {
      {"S3",
       "an audit with another priority",
       {},
       [](Case& c) {
         ++body<ThreadSched>(read_back(c, tid_of(c, A), SchedMoment::audit)).priority;
       },
       {"S3"},
       {}},
      {"S3",
       "an audit with more CPUs",
       {},
       [](Case& c) {
         body<ThreadSched>(read_back(c, tid_of(c, A), SchedMoment::audit)).cpus = cpus(c, {0, 1});
       },
       {"S3"},
       {}},
      {"S3",
       "one switch with another priority",
       {},
       [](Case& c) {
         const auto is_it = [tid = tid_of(c, A)](const SchedSwitch& change, const EventHead& head) {
           return change.next_tid == tid && head.time.ns > kBeginning + 10'000'000;
         };
         body<SchedSwitch>(event<SchedSwitch>(c.trace, is_it)).next_prio = 10;
       },
       {"S3"},
       {}},
      {"S3",
       "a thread that is reniced in between",
       {},
       [](Case& c) { renice(c, D, 125); },
       {"S3"},
       {}},
  };
}

// Takes from the thread's read-backs of these moments a CPU that it ran on.
void leave_out_used_cpu(Case& c, const std::set<SchedMoment>& moments) {
  const auto used = *of_callback<CallbackStart>(c, B, 5).head.cpu;
  const auto tid = static_cast<std::uint32_t>(tid_of(c, B));
  for (auto& e : c.trace.events) {
    auto* read = std::get_if<ThreadSched>(&e.body);
    if (read != nullptr && read->tid == tid && moments.contains(*read->moment)) {
      read->cpus = cpus(c, {static_cast<std::uint32_t>(1 - used)});
    }
  }
}

std::vector<Mutant> allowed_cpus() {
  return {
      {"S4",
       "a mask that leaves out a CPU it ran on",
       {},
       [](Case& c) {
         leave_out_used_cpu(c, {SchedMoment::applied, SchedMoment::audit});
       },
       {"S4"},
       {}},
      {"S4",
       "outside the mask that it began with, and not in the one that it was given",
       {},
       [](Case& c) {
         leave_out_used_cpu(c, {SchedMoment::initial, SchedMoment::applied, SchedMoment::audit});
       },
       {"S4"},
       {}},
      {"S4",
       "an event on another CPU",
       {},
       [](Case& c) {
         const auto is_it = [tid = tid_of(c, A)](const ThreadWakeup&, const EventHead& head) {
           return head.tid == tid;
         };
         event<ThreadWakeup>(c.trace, is_it, 3).head.cpu = 1;
         c.spec.of("/n0@A").foreign_work_budget.reset();  // its thread's time has a gap
       },
       {"S4"},
       {}},
  };
}

std::vector<Mutant> leaks() {
  const auto of = [](Place place) { return [place](const Case& c) { return tid_of(c, place); }; };
  return {
      {"S5", "a thread that begins as SCHED_FIFO", {}, begins_as(of(A), Policy::fifo), {"S5"}, {}},
      {"S5",
       "a thread that begins as SCHED_DEADLINE",
       {},
       begins_as(of(E), Policy::deadline),
       {"S5"},
       {}},
      {"S5",
       "a receive thread that begins as SCHED_RR",
       {},
       begins_as(receiver_of, Policy::round_robin),
       {"S5"},
       {}},
      {"S5",
       "a child that is nobody's and runs as its parent",
       {},
       [](Case& c) { fork_real_time(c, tid_of(c, A)); },
       {"S5"},
       {}},
  };
}

}  // namespace

std::vector<Mutant> parameter_mutants() {
  std::vector<Mutant> all;
  for (auto& some : {specified_parameters(), unchanged(), allowed_cpus(), leaks()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace cie::sim
