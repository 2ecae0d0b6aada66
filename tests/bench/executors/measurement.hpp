// One row of the experiment: processes are started, measured for a while, and ended.
#pragma once

#include "kernel_counts.hpp"
#include "workload.hpp"

#include <cstdint>
#include <optional>

namespace bench {

struct Measurement {
  double seconds = 0;
  std::uint64_t messages = 0;
  KernelCounts counts{};                   // of all threads of all processes, those of DDS too
  std::optional<std::uint64_t> pss_kib{};  // proportional set size, all processes together
  double latency_mean_us = 0;              // publish to callback
  double latency_p50_us = 0;
  double latency_p99_us = 0;

  std::optional<double> per_message(std::optional<std::uint64_t> count) const;
};

// Nothing when a process failed, which has said why.
std::optional<Measurement> measure(const Workload& workload, double seconds);

// System calls are counted by an event whose number stands in tracefs. Where that is not mounted,
// root may mount it for this process alone.
void make_tracefs_visible();

}  // namespace bench
