#include <cstdlib>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rcl/arguments.h>
#include <rcl/error_handling.h>
#include <rcl_yaml_param_parser/parser.h>
#include <rclcpp/logging.hpp>

namespace cie_rclcpp {
namespace {

// A parameter of the command line that is meant for all nodes: `--ros-args -p NAME:=TEXT`.
std::optional<std::string> ros_parameter(const rclcpp::Context::SharedPtr& context,
                                         const char* name) {
  if (!context || !context->is_valid()) return std::nullopt;
  rcl_params_t* overrides = nullptr;
  if (rcl_arguments_get_param_overrides(&context->get_rcl_context()->global_arguments,
                                        &overrides) != RCL_RET_OK) {
    rcl_reset_error();
    return std::nullopt;
  }
  if (overrides == nullptr) return std::nullopt;
  const std::unique_ptr<rcl_params_t, void (*)(rcl_params_t*)> owner{overrides,
                                                                     rcl_yaml_node_struct_fini};
  for (std::size_t node = 0; node < overrides->num_nodes; ++node) {
    if (std::string{overrides->node_names[node]} != "/**") continue;
    const rcl_node_params_t& parameters = overrides->params[node];
    for (std::size_t i = 0; i < parameters.num_params; ++i) {
      if (std::string{parameters.parameter_names[i]} != name) continue;
      const char* const text = parameters.parameter_values[i].string_value;
      if (text == nullptr) throw std::invalid_argument{std::string{name} + " is not a text"};
      return text;
    }
  }
  return std::nullopt;
}

std::optional<std::string> setting(const rclcpp::Context::SharedPtr& context, const char* parameter,
                                   const char* variable) {
  if (auto text = ros_parameter(context, parameter)) return text;
  const char* const text = std::getenv(variable);
  return text != nullptr && *text != '\0' ? std::optional<std::string>{text} : std::nullopt;
}

}  // namespace

cie::ExecutorOptions options_from_environment(const rclcpp::Context::SharedPtr& context) {
  cie::ExecutorOptions options;
  options.on_scheduling_problem = [](const cie::SchedulingProblem& problem) {
    RCLCPP_WARN(rclcpp::get_logger("cie_rclcpp"), "%s", problem.text().c_str());
  };
  if (const auto file = setting(context, "cie_spec", "CIE_SPEC")) {
    options.spec = std::make_shared<const cie::SchedulingSpec>(cie::SchedulingSpec::load(*file));
  }
  const auto on_error = setting(context, "cie_on_error", "CIE_ON_ERROR");
  if (!on_error || *on_error == "refuse") return options;
  if (*on_error != "warn") {
    throw std::invalid_argument{"cie_on_error is \"" + *on_error +
                                "\": say \"refuse\" or \"warn\""};
  }
  options.on_error = cie::OnError::warn;
  return options;
}

}  // namespace cie_rclcpp
