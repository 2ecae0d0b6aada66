#include "parameter_orders.hpp"

#include <stdexcept>
#include <utility>

namespace cie::container {
namespace {

std::string line_of(const Node& node, const std::string& name) {
  return node.fully_qualified_name() + " " + name + " " + to_text(node.get_parameter(name)) + "\n";
}

std::string list(const Node& node) {
  std::string text;
  for (const std::string& name : node.list_parameters())
    text += line_of(node, name);
  return text;
}

template <typename Range>
std::string range_line(const Range& range) {
  return "range: " + to_text(range.from) + " to " + to_text(range.to) +
         (range.step != 0 ? " in steps of " + to_text(static_cast<decltype(range.to)>(range.step))
                          : "") +
         "\n";
}

std::string describe(const Node& node, const std::string& name) {
  const ParameterDescriptor descriptor = node.describe_parameter(name);
  const ParameterValue value = node.get_parameter(name);
  std::string text = line_of(node, name) + "type: " + std::string{kind_name(kind_of(value))} +
                     (descriptor.is_dynamically_typed ? ", may change" : "") + "\n";
  if (!descriptor.description.empty()) text += "description: " + descriptor.description + "\n";
  if (!descriptor.additional_constraints.empty()) {
    text += "constraints: " + descriptor.additional_constraints + "\n";
  }
  if (descriptor.is_read_only) text += "read-only\n";
  if (descriptor.integer_range) text += range_line(*descriptor.integer_range);
  if (descriptor.floating_point_range) text += range_line(*descriptor.floating_point_range);
  return text;
}

std::string set(Node& node, const std::string& name, const std::string& text) {
  const ParameterValue current = node.get_parameter(name);
  const bool may_change_type = node.describe_parameter(name).is_dynamically_typed;
  const auto kind = may_change_type ? ParameterKind::not_set : kind_of(current);
  ParameterValue value;
  try {
    value = parse_parameter(name, parameter_text(text), kind);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error{error.what()};
  }
  const auto result = node.set_parameter(name, std::move(value));
  if (!result.is_successful) throw std::runtime_error{"not set: " + result.reason};
  return line_of(node, name);
}

}  // namespace

std::string follow_parameter_order(Container& container, const std::vector<std::string>& words) {
  const std::string order = words.empty() ? "" : words[0];
  if (order == "list" && words.size() == 1) {
    std::string text;
    for (const std::string& name : container.names())
      text += container.with_node(name, [](Node& node) { return list(node); });
    return text;
  }
  const auto with_node = [&](auto function) { return container.with_node(words[1], function); };
  if (order == "list" && words.size() == 2) {
    return with_node([](Node& node) { return list(node); });
  }
  if (order == "get" && words.size() == 3) {
    return with_node([&](Node& node) { return to_text(node.get_parameter(words[2])) + "\n"; });
  }
  if (order == "describe" && words.size() == 3) {
    return with_node([&](Node& node) { return describe(node, words[2]); });
  }
  if (order == "set" && words.size() == 4) {
    return with_node([&](Node& node) { return set(node, words[2], words[3]); });
  }
  throw std::invalid_argument{
      "no such order: param list [NODE], param get NODE NAME, param set NODE NAME VALUE and param "
      "describe NODE NAME are known"};
}

}  // namespace cie::container
