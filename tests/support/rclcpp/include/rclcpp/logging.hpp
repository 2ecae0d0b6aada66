#pragma once

#include <string>

namespace rclcpp {

struct Logger {
  std::string name;
};
inline Logger get_logger(const std::string& name) { return {name}; }

// As rcutils writes it to the console.
[[gnu::format(printf, 3, 4)]] void log(const char* severity, const Logger& logger,
                                       const char* format, ...);

}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) ::rclcpp::log("INFO", logger, __VA_ARGS__)
#define RCLCPP_WARN(logger, ...) ::rclcpp::log("WARN", logger, __VA_ARGS__)
#define RCLCPP_ERROR(logger, ...) ::rclcpp::log("ERROR", logger, __VA_ARGS__)
