// When the kernel of a host was recorded: by several traces, of which each tells of some CPUs for some
// time.
#pragma once

#include <cie/analysis/time.hpp>

#include <cstdint>
#include <optional>
#include <set>
#include <vector>

namespace cie::analysis {

// Edges included.
struct Stretch {
  Timestamp begin;
  Timestamp end = kLatest;

  bool operator==(const Stretch&) const = default;
};

// What one trace covers.
struct KernelPart {
  bool has_switches = false;        // it declares sched_switch
  std::set<std::int32_t> cpus{};    // empty: it does not say, and is taken to have all
  std::optional<Stretch> covers{};  // what all of its streams do; empty: nothing (yet)
};

// Where every CPU that a part tells of is covered by a part, or this one alone; in order, apart from one
// another. Traces with switches and traces without tell of different things: both are needed.
std::vector<Stretch> recorded(const std::vector<KernelPart>& parts,
                              std::optional<std::int32_t> cpu = std::nullopt);

}  // namespace cie::analysis
