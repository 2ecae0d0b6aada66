// Scheduling parameters of the spec, asked of the kernel and compared with what it reports.
#pragma once

#include <cie/scheduling/exclusive_cpusets.hpp>
#include <cie/scheduling/kernel_calls.hpp>
#include <cie/scheduling/sched_request.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace cie::scheduling {

// Asks for the parameters of a thread of this process (0: the caller). Affinity goes before the
// policy, and after it where the thread leaves SCHED_DEADLINE, under which it cannot change.
// Real-time threads get SCHED_RESET_ON_FORK, so that threads they create do not inherit what they
// were not given, and so that DEADLINE threads can create any. Stops at the first refusal.
SchedRequest request(KernelCalls& calls, std::uint32_t tid, const ThreadParameters& parameters,
                     ExclusiveCpusets& cpusets);

// What the kernel reports otherwise than asked, each in words: "policy is SCHED_OTHER instead of
// SCHED_FIFO". Empty if all is as asked; an absent policy or affinity is not compared.
std::vector<std::string> differences(const ThreadParameters& asked,
                                     const trace::SchedReadBack& reported);

}  // namespace cie::scheduling
