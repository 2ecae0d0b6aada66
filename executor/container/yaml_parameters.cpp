#include "yaml_parameters.hpp"

#include <cstddef>
#include <string>

namespace cie::container {
namespace {

constexpr std::size_t kMaxParameters = 10'000;  // of one component, items of lists included

// The number of values, because aliases can make a short file long.
void read_into(ParameterOverrides& parameters, const yaml::Value& map, const std::string& what,
               const std::string& prefix, std::size_t& count) {
  for (const auto& [name, value] : map.fields(what)) {
    if (value.is_null()) continue;
    if (++count > kMaxParameters) value.fail("more than 10000 parameters; read a file of them");
    if (value.is_map()) {
      read_into(parameters, value, name, prefix + name + ".", count);
      continue;
    }
    ParameterText& parameter = parameters[prefix + name];
    parameter.is_list = value.is_sequence();
    if (!parameter.is_list) {
      parameter.texts = {value.text(name)};
      continue;
    }
    for (const yaml::Value& item : value.items(name)) {
      if (++count > kMaxParameters) item.fail("more than 10000 parameters; read a file of them");
      parameter.texts.push_back(item.text(name));
    }
  }
}

}  // namespace

ParameterOverrides read_parameters(const yaml::Value& map) {
  ParameterOverrides parameters;
  std::size_t count = 0;
  read_into(parameters, map, "parameters", "", count);
  return parameters;
}

}  // namespace cie::container
