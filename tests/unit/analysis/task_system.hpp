// Reports of callbacks as scheduling theory sees them. Times are of any one unit.
#pragma once

#include <cie/analysis/schedulability.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace cie::analysis {

inline Summary extremes(std::int64_t min, std::int64_t max) {
  Summary summary;
  summary.count = 2;
  summary.min = min;
  summary.max = max;
  return summary;
}

// A report of callbacks on threads of their own, all on CPU 0 unless a test says otherwise.
class TaskSystem {
 public:
  struct Parameters {
    std::int64_t execution = 0;
    std::int64_t inter_arrival = 0;
    std::int64_t response = 0;
    Policy policy = Policy::fifo;
    std::uint32_t priority = 0;
    std::vector<std::uint32_t> cpus{0};
  };

  CallbackReport& add(const std::string& id, const Parameters& p) {
    auto& thread = report.threads.emplace_back();
    thread.index = ThreadIndex{static_cast<std::uint32_t>(report.threads.size() - 1)};
    thread.tid = 100 + static_cast<std::int64_t>(report.threads.size());
    thread.callbacks = {id};
    thread.sched = ThreadSchedReport{.moment = SchedMoment::applied,
                                     .policy = static_cast<std::int32_t>(p.policy),
                                     .policy_name = std::string(policy_name(p.policy)),
                                     .priority = p.priority,
                                     .cpus = p.cpus};
    auto& callback = report.callbacks.emplace_back();
    callback.logical_id = id;
    callback.index = CallbackIndex{static_cast<std::uint32_t>(report.callbacks.size() - 1)};
    callback.threads = {{.thread = thread.index, .tid = thread.tid, .name = id, .instances = 2}};
    callback.execution_time = extremes(0, p.execution);
    callback.inter_arrival = extremes(p.inter_arrival, p.inter_arrival);
    callback.response_time = extremes(0, p.response);
    return callback;
  }
  ProcessIndex add_process(Timestamp from, Timestamp to) {
    auto& process = report.processes.emplace_back();
    process.index = ProcessIndex{static_cast<std::uint32_t>(report.processes.size() - 1)};
    process.lived = {.from = from, .to = to};
    return process.index;
  }
  ThreadSchedReport& sched(std::size_t index) { return *report.threads[index].sched; }

  SchedulabilityReport analyzed(const std::string& spec_text = {}) const {
    if (spec_text.empty()) return schedulability_of(report, nullptr);
    const auto spec = SchedulingSpec::parse(spec_text, "spec.yaml");
    return schedulability_of(report, &spec);
  }

  Report report;
};

// Burns & Wellings' example, C = 3, 3, 5 and T = 7, 12, 20: responses 3, 6 and 20.
inline TaskSystem textbook() {
  TaskSystem system;
  system.add("high", {.execution = 3, .inter_arrival = 7, .response = 3, .priority = 30});
  system.add("mid", {.execution = 3, .inter_arrival = 12, .response = 6, .priority = 20});
  system.add("low", {.execution = 5, .inter_arrival = 20, .response = 14, .priority = 10});
  return system;
}

}  // namespace cie::analysis
