// The sections of a scheduling spec, read from YAML and validated. Private to SchedulingSpec.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/yaml_document.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie {

struct SpecSections {
  std::vector<SpecEntry> callbacks;
  std::vector<SpecEntry> threads;
  std::vector<SpecChain> chains;
  std::vector<std::pair<std::string, std::string>> hardware_info;
  std::vector<int> hardware_info_lines;
  std::vector<std::pair<std::string, int>> not_applied;
};

// The one id of `dds_threads` that stands for several names.
inline constexpr std::string_view kDdsQueues = "dq.*";

// What stands behind the node in the entry of all of its callbacks.
inline constexpr std::string_view kWildcard = "/*";

// Throws SpecError at the first value that is not as tracepoints/docs/scheduling_spec.md says. With a
// domain, entries of others are checked and left out.
SpecSections read_spec(const yaml::Value& document, std::optional<std::uint32_t> domain);

}  // namespace cie
