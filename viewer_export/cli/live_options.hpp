// What the user asks of `cie live`.
#pragma once

#include "base/network_address.hpp"
#include "choice.hpp"
#include "commands.hpp"
#include "save_trigger.hpp"

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace cie::cli {

struct LiveOptions {
  enum class View : std::uint8_t { screen, text, json, none };

  std::string target;  // URL or name of a session; empty: trace `command`, or what runs already
  Arguments command;
  bool is_ros2 = false;  // of applications of ROS 2: see cie-record's --ros2
  std::string spec_file;
  std::chrono::milliseconds interval{1000};
  View view = View::text;
  std::uint64_t count = 0;  // snapshots after which to end; 0: none
  bool with_instances = false;
  live::SortKey sort = live::SortKey::response;
  std::string filter;
  std::optional<NetworkAddress> listen;  // where; empty: no server
  std::string flight_directory;          // of a recorder that keeps snapshots; empty: none
  live::SaveLimits save_limits;
};

// Empty when help was asked for and printed. Throws UsageError.
std::optional<LiveOptions> parse_live_options(const Arguments& arguments);

// For cie-record.
Arguments recorder_arguments(const LiveOptions& options, int socket);

}  // namespace cie::cli
