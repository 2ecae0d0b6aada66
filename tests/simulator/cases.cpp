// Clean cases, and how they are changed.
#include "simulator/mutants.hpp"

#include <algorithm>
#include <stdexcept>

namespace cie::sim {
namespace {

using namespace analysis;

constexpr Ns kMicrosecond = 1'000;

Step compute(Ns least, Ns most) {
  return Compute{{.least = least * kMicrosecond, .most = most * kMicrosecond}};
}

ThreadParameters real_time(Policy policy, std::uint32_t priority,
                           std::optional<std::vector<std::uint32_t>> cpus = std::nullopt) {
  ThreadParameters parameters;
  parameters.policy = policy;
  parameters.priority = priority;
  parameters.cpus = std::move(cpus);
  return parameters;
}

ThreadParameters fair() {
  ThreadParameters parameters;
  parameters.policy = Policy::other;
  return parameters;
}

ThreadParameters deadline(Ns runtime, Ns period) {
  ThreadParameters parameters;
  parameters.policy = Policy::deadline;
  parameters.runtime_ns = static_cast<std::uint64_t>(runtime);
  parameters.deadline_ns = parameters.period_ns = static_cast<std::uint64_t>(period);
  return parameters;
}

Callback timer(const char* id, Ns period, std::vector<Step> steps) {
  Callback callback;
  callback.id = id;
  callback.period = period * kMicrosecond;
  callback.phase = 300 * kMicrosecond;
  callback.steps = std::move(steps);
  return callback;
}

Callback subscription(const char* id, int topic, std::vector<Step> steps) {
  Callback callback;
  callback.id = id;
  callback.kind = CallbackKind::subscription;
  callback.topic = topic;
  callback.steps = std::move(steps);
  return callback;
}

}  // namespace

System base_system() {
  System system;
  system.cpus = 2;
  system.mutexes = 1;
  system.duration = 30'000 * kMicrosecond;
  system.topics = {{.name = "/x", .is_local = true},
                   {.name = "/y", .is_local = false, .transport = {5'000, 20'000}},
                   {.name = "/z"}};
  system.callbacks = {
      timer("/n0@A", 2'000, {compute(20, 40), Send{0}, Lock{0}, compute(5, 10), Unlock{0}}),
      subscription("/n0@B", 0, {compute(30, 60), Send{1}}),
      subscription("/n0@C", 1, {compute(20, 50)}),
      timer("/n0@D", 3'000, {Lock{0}, compute(20, 30), Unlock{0}, Send{2}}),
      timer("/n0@E", 2'500, {compute(10, 30)}),
      timer("/n0@F", 4'000, {compute(5, 20), Sleep{{10'000, 20'000}}}),
  };
  const std::vector<ThreadParameters> parameters{
      real_time(Policy::fifo, 50, std::vector<std::uint32_t>{0}),
      real_time(Policy::fifo, 40),
      real_time(Policy::round_robin, 30, std::vector<std::uint32_t>{0, 1}),
      fair(),
      deadline(500 * kMicrosecond, 2'500 * kMicrosecond),
      fair()};
  for (int i = 0; i < static_cast<int>(parameters.size()); ++i) {
    system.servers.push_back({.name = "cb" + std::to_string(i),
                              .process = 0,
                              .is_isolated = true,
                              .callbacks = {i},
                              .parameters = parameters[static_cast<std::size_t>(i)]});
  }
  system.loads = {{.parameters = fair(), .period = 900 * kMicrosecond, .steps = {compute(50, 150)}},
                  {.parameters = real_time(Policy::fifo, 20),
                   .period = 1'300 * kMicrosecond,
                   .steps = {compute(20, 40)}}};
  system.receiver = real_time(Policy::fifo, 90);
  return system;
}

Case any_case(System system, std::uint64_t seed) {
  Case c;
  c.system = std::move(system);
  c.system.seed = seed;
  auto simulation = simulate(c.system);
  c.truth = std::move(simulation.truth);
  c.trace = simulation.tape.trace({});
  c.spec = spec_of(c.system, c.truth);
  return c;
}

Case clean_case(System system, std::uint64_t seed) {
  for (std::uint64_t attempt = 0; attempt < 1'000; ++attempt) {
    auto c = any_case(system, seed * 1'000 + attempt);
    if (keeps_every_rule(c.system, c.truth)) return c;
  }
  throw std::runtime_error("a thousand seeds, and none is clean");
}

std::int64_t pid_of(const Case& c, Place place) {
  return c.truth.pids.at(static_cast<std::size_t>(c.system.callbacks.at(place).process));
}

std::int64_t tid_of(const Case& c, Place place) {
  for (const auto& instance : c.truth.instances) {
    if (instance.callback == static_cast<int>(place)) return c.truth.threads[instance.thread].tid;
  }
  throw std::out_of_range("it never ran");
}

std::int64_t receiver_of(const Case& c) {
  return std::ranges::find(c.truth.threads, "recv", &ThreadTruth::name)->tid;
}

CallbackId id_of(const Case& c, Place place) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(place); ++i) {
    if (c.system.callbacks[i].process == c.system.callbacks.at(place).process) ++number;
  }
  return CallbackId{number};
}

std::string name_of(const Case& c, Place place) { return c.system.callbacks.at(place).id; }

Event& read_back(Case& c, std::int64_t tid, SchedMoment moment) {
  return event<ThreadSched>(c.trace, [&](const ThreadSched& read, const EventHead&) {
    return read.tid == static_cast<std::uint32_t>(tid) && read.moment == moment;
  });
}

Event& announcement(Case& c, std::int64_t tid) {
  return event<ThreadInit>(c.trace, [&](const ThreadInit& init, const EventHead&) {
    return init.tid == static_cast<std::uint32_t>(tid);
  });
}

void insert(test::TextTrace& trace, const Event& event) {
  const auto place = std::ranges::upper_bound(trace.events, event.head.time, {},
                                              [](const Event& e) { return e.head.time; });
  trace.events.insert(place, Event(event));
}

void remove(test::TextTrace& trace, const Event& event) {
  trace.events.erase(trace.events.begin() + (&event - trace.events.data()));
}

void sort_by_time(test::TextTrace& trace) {
  std::ranges::stable_sort(trace.events, {}, [](const Event& e) { return e.head.time; });
}

Ns quiet_time(const Case& c) {
  constexpr Ns kEnough = 20 * kMicrosecond;
  for (Ns time = kBeginning + c.system.duration / 2;; time += kEnough) {
    const auto is_near = [time](const InstanceTruth& instance) {
      return instance.release - kEnough < time && time < *instance.end + kEnough;
    };
    if (std::ranges::none_of(c.truth.instances, is_near)) return time;
  }
}

}  // namespace cie::sim
