// What is added to the times of streams to put them into one order.
#pragma once

#include "ctf/program/trace_plan.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace cie::analysis::ctf {

// One boot has one clock, whatever offset to the wall clock each of its traces measured: one offset
// serves all. But a time namespace (a container's) has a clock of its own, and tells the machine's
// boot: where another host of the boot is far off, it keeps its own.
class MergeOffsets {
 public:
  std::int64_t of(const ClockPlan& clock, const std::string& host) {
    if (clock.uuid.empty()) return clock.offset_ns;
    auto& hosts = by_boot_[clock.uuid];
    if (const auto known = hosts.find(host); known != hosts.end()) return known->second;
    auto offset = clock.offset_ns;
    for (const auto& [name, other] : hosts) {
      if (detail::are_alike(offset, other)) offset = other;
    }
    return hosts.try_emplace(host, offset).first->second;
  }

 private:
  std::map<std::string, std::map<std::string, std::int64_t>> by_boot_;
};

}  // namespace cie::analysis::ctf
