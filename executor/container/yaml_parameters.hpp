// Parameters as YAML files have them.
#pragma once

#include <cie/executor/parameters.hpp>

#include "base/yaml_document.hpp"

#include <filesystem>
#include <string>

namespace cie::container {

// A map of parameters; of a map within it, the names are joined by dots. Throws SpecError.
ParameterOverrides read_parameters(const yaml::Value& map);

// What a file contains; the parser refuses what is too long. Throws SpecError.
std::string read_text(const std::filesystem::path& file);

}  // namespace cie::container
