#include "simulator/clean.hpp"

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

namespace cie::sim {
namespace {

void write(std::ostringstream& out, const char* key, const std::optional<Ns>& value) {
  if (value) out << "    " << key << ": " << *value << '\n';
}

void write(std::ostringstream& out, const ThreadParameters& parameters) {
  out << "    policy: " << policy_name(*parameters.policy) << '\n';
  switch (*parameters.policy) {
    case Policy::fifo:
    case Policy::round_robin:
      out << "    priority: " << parameters.priority << '\n';
      break;
    case Policy::deadline:
      out << "    runtime: " << parameters.runtime_ns
          << "\n    deadline: " << parameters.deadline_ns
          << "\n    period: " << parameters.period_ns << '\n';
      break;
    case Policy::other:
    case Policy::batch:
      out << "    nice: " << parameters.nice << '\n';
      break;
    case Policy::idle:
      break;
  }
  if (!parameters.cpus) return;
  out << "    affinity: [";
  for (std::size_t i = 0; i < parameters.cpus->size(); ++i)
    out << (i == 0 ? "" : ", ") << (*parameters.cpus)[i];
  out << "]\n";
}

void write(std::ostringstream& out, const char* key, const Spec::Entry& entry) {
  out << "  - " << key << ": " << entry.id << '\n';
  if (entry.parameters) write(out, *entry.parameters);
  write(out, "response_deadline", entry.response_deadline);
  write(out, "wcet", entry.wcet);
  write(out, "min_inter_arrival", entry.min_inter_arrival);
  write(out, "max_inter_arrival", entry.max_inter_arrival);
  write(out, "foreign_work_budget", entry.foreign_work_budget);
  write(out, "missed_releases_allowed", entry.missed_releases_allowed);
  write(out, "overwrites_allowed", entry.overwrites_allowed);
}

struct Extremes {
  std::size_t instances = 0;
  Ns response = 0;
  Ns execution = 0;
  std::vector<Ns> releases{};

  std::vector<Ns> arrivals() const {
    std::vector<Ns> gaps;
    for (std::size_t i = 1; i < releases.size(); ++i)
      gaps.push_back(releases[i] - releases[i - 1]);
    return gaps;
  }
};

std::vector<Extremes> extremes_of(const System& system, const Truth& truth) {
  std::vector<Extremes> all(system.callbacks.size());
  for (const auto& instance : truth.instances) {
    auto& extremes = all[static_cast<std::size_t>(instance.callback)];
    ++extremes.instances;
    extremes.response = std::max(extremes.response, *instance.end - instance.release);
    extremes.execution = std::max(extremes.execution, instance.parts.execution);
    extremes.releases.push_back(instance.release);
  }
  return all;
}

// What a thread works outside callbacks from its first wait on, per second, rounded up.
Ns foreign_work(const Truth& truth, std::size_t thread) {
  const auto& facts = truth.threads[thread];
  Ns foreign = facts.execution - facts.execution_before;
  for (const auto& instance : truth.instances) {
    if (instance.thread != thread) continue;
    const auto end = instance.execution_before + instance.parts.execution;
    foreign -= std::max<Ns>(end - std::max(instance.execution_before, facts.execution_before), 0);
  }
  const auto span = facts.end - facts.first_wait;
  return span > 0 ? (foreign * 1'000'000'000 + span - 1) / span : 0;
}

std::size_t thread_named(const Truth& truth, const std::string& name) {
  const auto found = std::ranges::find(truth.threads, name, &ThreadTruth::name);
  return static_cast<std::size_t>(found - truth.threads.begin());
}

}  // namespace

Spec::Entry& Spec::of(const std::string& id) {
  for (auto* entries : {&callbacks, &threads}) {
    const auto found = std::ranges::find(*entries, id, &Entry::id);
    if (found != entries->end()) return *found;
  }
  throw std::out_of_range("no entry for " + id);
}

std::string Spec::text() const {
  std::ostringstream out;
  if (!callbacks.empty()) out << "callback_groups:\n";
  for (const auto& entry : callbacks)
    write(out, "id", entry);
  if (!threads.empty()) out << "non_ros_threads:\n";
  for (const auto& entry : threads)
    write(out, "name", entry);
  if (!chains.empty()) out << "chains:\n";
  for (const auto& chain : chains) {
    out << "  - name: " << chain.name << "\n    callbacks: [";
    for (std::size_t i = 0; i < chain.callbacks.size(); ++i)
      out << (i == 0 ? "" : ", ") << '"' << chain.callbacks[i] << '"';
    out << "]\n";
    write(out, "path_latency", chain.path_latency);
    write(out, "reaction_time", chain.reaction_time);
    write(out, "data_age", chain.data_age);
  }
  return out.str();
}

bool keeps_every_rule(const System& system, const Truth& truth) {
  const auto is_unclean = [](const InstanceTruth& instance) {
    return !instance.end || instance.missed != 0;
  };
  if (std::ranges::any_of(truth.instances, is_unclean)) return false;
  if (std::ranges::any_of(truth.overwritten, [](std::uint64_t count) { return count != 0; })) {
    return false;
  }
  return std::ranges::all_of(extremes_of(system, truth), [](const Extremes& extremes) {
    const auto gaps = extremes.arrivals();
    return extremes.instances > 0 && (gaps.empty() || std::ranges::min(gaps) > extremes.response);
  });
}

Spec spec_of(const System& system, const Truth& truth) {
  Spec spec;
  const auto extremes = extremes_of(system, truth);
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    if (extremes[i].instances == 0) continue;
    Spec::Entry entry{.id = system.callbacks[i].id};
    const auto server = std::ranges::find_if(system.servers, [i](const Server& candidate) {
      return candidate.is_isolated && candidate.callbacks.front() == static_cast<int>(i);
    });
    if (server != system.servers.end()) {
      entry.parameters = server->parameters;
      entry.foreign_work_budget = foreign_work(truth, thread_named(truth, server->name));
    }
    entry.response_deadline = extremes[i].response;
    entry.wcet = extremes[i].execution;
    if (const auto gaps = extremes[i].arrivals(); !gaps.empty()) {
      entry.min_inter_arrival = std::ranges::min(gaps);
      entry.max_inter_arrival = std::ranges::max(gaps);
    }
    spec.callbacks.push_back(entry);
  }
  Spec::Entry receiver{.id = "recv"};
  receiver.parameters = system.receiver;
  for (std::size_t i = 0; i < truth.threads.size(); ++i) {
    if (truth.threads[i].name != "recv") continue;
    receiver.foreign_work_budget =
        std::max(receiver.foreign_work_budget.value_or(0), foreign_work(truth, i));
  }
  spec.threads.push_back(receiver);
  for (const auto& chain : chains_of(system, truth)) {
    if (chain.is_overtaken) continue;
    Spec::Chain asked{.name = "chain" + std::to_string(spec.chains.size())};
    for (const auto hop : chain.hops)
      asked.callbacks.push_back(system.callbacks[static_cast<std::size_t>(hop)].id);
    Ns latency = 0;
    for (const auto& run : chain.runs) {
      Ns total = 0;
      for (const auto time : run.processing)
        total += time;
      for (const auto time : run.communication)
        total += time;
      latency = std::max(latency, total);
    }
    asked.path_latency = latency;
    if (const auto times = chain.reaction_times(); !times.empty()) {
      asked.reaction_time = std::ranges::max(times);
    }
    if (const auto ages = chain.data_ages(); !ages.empty()) asked.data_age = std::ranges::max(ages);
    spec.chains.push_back(asked);
  }
  return spec;
}

}  // namespace cie::sim
