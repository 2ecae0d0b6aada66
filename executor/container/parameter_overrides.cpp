#include "parameter_overrides.hpp"

#include "base/yaml_fields.hpp"
#include "yaml_parameters.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>

namespace cie::container {
namespace {

constexpr std::array<std::string_view, 1> kNodeKeys{"ros__parameters"};

ComponentEntry* find_component(AppFile& app, const std::string& name) {
  const auto found = std::ranges::find(app.components, name, &ComponentEntry::qualified_name);
  return found == app.components.end() ? nullptr : &*found;
}

}  // namespace

void override_parameter(AppFile& app, const std::string& assignment) {
  const auto sign = assignment.find(":=");
  const auto colon = assignment.find(':');
  if (sign == std::string::npos || colon == sign || colon == 0 || colon + 1 == sign) {
    throw std::invalid_argument{"\"" + assignment +
                                "\" sets no parameter: write NODE:NAME:=VALUE, for instance "
                                "/example/talker:period_ms:=50"};
  }
  const std::string node = assignment.substr(0, colon);
  ComponentEntry* const component = find_component(app, node);
  if (component == nullptr) {
    throw std::invalid_argument{"\"" + assignment + "\": " + app.file + " has no component \"" +
                                node + "\""};
  }
  const std::string name = assignment.substr(colon + 1, sign - colon - 1);
  component->parameters.insert_or_assign(name, parameter_text(assignment.substr(sign + 2)));
  component->overridden[name] = "-p " + assignment;
}

void override_parameters(AppFile& app, const std::filesystem::path& file) {
  const std::string text = yaml::read_file(file);
  const std::string name = file.string();
  const auto document = yaml::parse(text, name, "node: {ros__parameters: {}}");
  for (const auto& [node, value] : yaml::Value{*document, name}.fields("the file")) {
    if (node.find('*') != std::string::npos) {
      value.fail("\"" + node + "\" is a pattern, which is not supported; write a node's name");
    }
    const yaml::Fields fields{value, node, kNodeKeys};
    ComponentEntry* const component =
        find_component(app, node.starts_with('/') ? node : "/" + node);
    const yaml::Value* const parameters = fields.find("ros__parameters");
    if (component == nullptr || parameters == nullptr) continue;
    for (auto& [parameter, given] : read_parameters(*parameters)) {
      component->parameters.insert_or_assign(parameter, std::move(given));
      component->overridden[parameter] = name;
    }
  }
}

}  // namespace cie::container
