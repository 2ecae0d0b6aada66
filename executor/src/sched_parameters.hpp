// Scheduling parameters of the spec, asked of the kernel and compared with what it reports.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace cie::executor {

// The outcome of asking. error 0: everything was accepted.
struct SchedRequest {
  int error = 0;
  std::string what;    // the refused request: "SCHED_FIFO 80", "CPUs 0,1"
  std::string reason;  // the kernel's word and the remedy
};

// Asks for the parameters of a thread of this process (0: the caller). Affinity first: a thread
// under SCHED_DEADLINE can no longer change it. Real-time threads get SCHED_RESET_ON_FORK, so that
// threads they create do not inherit what they were not given, and so that DEADLINE threads can
// create any. Stops at the first refusal.
SchedRequest request(std::uint32_t tid, const ThreadParameters& parameters);

// What the kernel reports otherwise than asked, each in words: "policy is SCHED_OTHER instead of
// SCHED_FIFO". Empty if all is as asked; an absent policy or affinity is not compared.
std::vector<std::string> differences(const ThreadParameters& asked,
                                     const trace::SchedReadBack& reported);

}  // namespace cie::executor
