// Parameters as YAML files have them.
#pragma once

#include <cie/executor/parameters.hpp>

#include "base/yaml_document.hpp"

namespace cie::container {

// A map of parameters; of a map within it, the names are joined by dots. Throws SpecError.
ParameterOverrides read_parameters(const yaml::Value& map);

}  // namespace cie::container
