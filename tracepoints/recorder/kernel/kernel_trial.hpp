// Records the scheduler for a moment, as a recording would, and counts what the kernel left out:
// what it promises (BTF, capabilities) does not say whether it keeps that on a virtual machine.
#pragma once

#include "kernel/kernel_source.hpp"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace cie::record {

struct KernelTrial {
  struct Cpu {
    std::uint32_t number = 0;
    std::uint64_t switches = 0;  // told
    std::uint64_t untold = 0;    // as SwitchCheck finds them, though no buffer overran
    std::uint64_t lost = 0;      // events, because the buffer was full
  };

  std::string route;  // "bpf", "tracefs"
  std::chrono::nanoseconds length{};
  std::vector<Cpu> cpus;
};

// Meanwhile a thread on each CPU wakes every millisecond, as callbacks do. Writes no file. Throws
// KernelUnavailable and RecordError.
KernelTrial try_kernel_events(KernelSource& source, std::chrono::milliseconds length);

// For `cie doctor`: one line of JSON (`cie.kernel-trial/1`) with what try_kernel_events() found, or
// with the `reason` why the kernel's events cannot be recorded.
std::string kernel_trial_json(KernelRoute route, std::uint64_t buffer_size,
                              std::chrono::milliseconds length);

}  // namespace cie::record
