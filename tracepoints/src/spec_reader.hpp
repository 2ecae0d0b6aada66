// The sections of a scheduling spec, read from YAML and validated. Private to SchedulingSpec.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "yaml_document.hpp"

#include <string>
#include <utility>
#include <vector>

namespace cie {

struct SpecSections {
  std::vector<SpecEntry> callbacks;
  std::vector<SpecEntry> threads;
  std::vector<SpecChain> chains;
  std::vector<std::pair<std::string, std::string>> hardware_info;
};

// Throws SpecError at the first value that is not as tracepoints/README.md ("Scheduling spec")
// says.
SpecSections read_spec(const yaml::Value& document);

}  // namespace cie
