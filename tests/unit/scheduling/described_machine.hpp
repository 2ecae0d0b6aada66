// A machine of a test's own: its threads, what they run as, and what its kernel refuses.
#pragma once

#include <cie/scheduling/kernel_calls.hpp>

#include "kernel_tree.hpp"

#include <cerrno>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::scheduling {

class DescribedKernel final : public KernelCalls {
 public:
  using Threads = std::map<std::uint32_t, trace::SchedReadBack>;
  // 0, or the errno with which it refuses these attributes.
  using Refusal = std::function<int(std::uint32_t tid, const SchedAttr& attributes)>;

  // What each thread runs as; who is not here is gone.
  Threads threads;
  Refusal refusal = [](std::uint32_t, const SchedAttr&) { return 0; };
  bool is_deaf = false;  // accepts attributes, and does nothing
  // Every request in its order: "7 SCHED_FIFO", "7 CPUs 1".
  std::vector<std::string> requests;
  // Every read-back that went into the trace: "7 applied", "7 applied 1" with its error.
  std::vector<std::string> emitted;

  int set_attributes(std::uint32_t tid, const SchedAttr& attributes) override {
    const auto policy = static_cast<Policy>(attributes.policy);
    requests.push_back(std::to_string(tid) + " " + std::string{policy_name(policy)});
    if (!threads.contains(tid)) return ESRCH;
    if (const int error = refusal(tid, attributes); error != 0) return error;
    if (is_deaf) return 0;
    trace::SchedReadBack& thread = threads.at(tid);
    thread.policy = static_cast<std::int32_t>(attributes.policy);
    thread.nice = attributes.nice;
    thread.priority = attributes.priority;
    thread.runtime_ns = policy == Policy::deadline ? attributes.runtime : 0;
    thread.deadline_ns = attributes.deadline;
    thread.period_ns = attributes.period;
    return 0;
  }

  int set_affinity(std::uint32_t tid, const std::vector<std::uint32_t>& cpus) override {
    std::string list;
    for (const std::uint32_t cpu : cpus)
      list += " " + std::to_string(cpu);
    requests.push_back(std::to_string(tid) + " CPUs" + list);
    if (!threads.contains(tid)) return ESRCH;
    if (cpus.empty() || cpus.back() > kLastCpu) return EINVAL;
    threads.at(tid).cpus = cpus;
    return 0;
  }

  std::optional<trace::SchedReadBack> read_back(std::uint32_t tid) override {
    const auto thread = threads.find(tid);
    return thread == threads.end() ? std::nullopt : std::optional{thread->second};
  }

  std::optional<trace::SchedReadBack> emit(trace::Thread& thread, SchedMoment moment,
                                           int error) override {
    emitted.push_back(std::to_string(thread.tid()) +
                      (moment == SchedMoment::audit ? " audit" : " applied") +
                      (error == 0 ? "" : " " + std::to_string(error)));
    return read_back(thread.tid());
  }

 private:
  static constexpr std::uint32_t kLastCpu = 3;
};

// Four CPUs, all of which a thread may use; nobody has a capability.
class DescribedMachine : public KernelTree {
 protected:
  DescribedMachine() {
    write("proc/thread-self/status", "CapEff:\t0000000000000000\nCpus_allowed_list:\t0-3\n");
    write("proc/self/uid_map", "         0          0 4294967295\n");
    write("sys/devices/system/cpu/online", "0-3\n");
  }

  // A thread as the kernel starts one. Its id is above those that Linux gives.
  std::uint32_t new_thread() {
    constexpr std::uint32_t kMostTid = 4'194'304;
    const std::uint32_t tid = kMostTid + static_cast<std::uint32_t>(calls.threads.size()) + 1;
    calls.threads[tid].cpus = {0, 1, 2, 3};
    return tid;
  }

  DescribedKernel calls;
};

}  // namespace cie::scheduling
