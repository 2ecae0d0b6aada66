#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace rcl_interfaces::msg {
struct ParameterType {
  static constexpr std::uint8_t PARAMETER_INTEGER = 2;
};
struct ParameterValue {
  std::uint8_t type = 0;
  std::int64_t integer_value = 0;
};
struct Parameter {
  std::string name{};
  ParameterValue value{};
};
struct SetParametersResult {
  bool successful = false;
  std::string reason{};
};
struct ParameterEvent {
  std::string node{};
};
}  // namespace rcl_interfaces::msg

namespace rcl_interfaces::srv {
struct SetParameters {
  struct Request {
    using SharedPtr = std::shared_ptr<Request>;
    std::vector<msg::Parameter> parameters{};
  };
  struct Response {
    using SharedPtr = std::shared_ptr<Response>;
    std::vector<msg::SetParametersResult> results{};
  };
};
}  // namespace rcl_interfaces::srv
