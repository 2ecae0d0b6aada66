// When the kernel's traces of each host that are evidence cover its CPUs: what kernel_coverage knows of CPUs,
// and channel_windows of times.
#pragma once

#include <cie/analysis/time.hpp>

#include "channel_windows.hpp"
#include "covered_window.hpp"
#include "kernel_coverage.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "model/kernel_record.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace cie::analysis {

class KernelRecords {
 public:
  KernelRecords(const Model& model, const ChannelWindows& windows, const KernelCoverage& coverage,
                std::optional<TimeWindow> asked)
      : model_(model), windows_(windows), coverage_(coverage), asked_(asked) {}

  // The time around `time` in which they cover all of the host's CPUs, or this one. Empty begin: they do
  // not at that time, or are none.
  CoveredWindow window(HostIndex host, Timestamp time, std::optional<std::int32_t> cpu) const;
  // The same, whatever window was asked for: before and after it some CPU's record is missing.
  CoveredWindow record(HostIndex host, Timestamp time, std::optional<std::int32_t> cpu) const;
  // When they began to cover all of the host's CPUs; empty: they do not yet.
  std::optional<Timestamp> begin(HostIndex host) const;

 private:
  struct Record {
    std::uint64_t changes = 0;  // of channels and of their CPUs, when it was found out
    std::vector<KernelPart> parts;
    std::vector<Stretch> of_all_cpus;
    bool are_cpus_alike = true;  // each part has the same
    std::map<std::int32_t, std::vector<Stretch>> of_cpu;
  };
  Record& record_of(HostIndex host) const;
  std::vector<KernelPart> parts_of(HostIndex host) const;
  std::optional<Stretch> covered(const std::vector<const ChannelWindows::Channel*>& channels) const;

  const Model& model_;
  const ChannelWindows& windows_;
  const KernelCoverage& coverage_;
  std::optional<TimeWindow> asked_;
  mutable ByIndex<HostIndex, Record> records_{};  // found out when somebody asks
};

// Some kernel events are of a boot in which none of its machine's applications was recorded.
bool has_foreign_kernel(const Model& model);

}  // namespace cie::analysis
