// Executors to compare with: each dispatches as rclcpp does, over a DDS wait set.
#pragma once

#include <cie/executor/executor.hpp>

#include <memory>
#include <string_view>

namespace cie::executor {

// `name`: "single-waitset", "multi-waitset", "isolated-waitset".
std::unique_ptr<Executor> make_baseline(std::string_view name, ExecutorOptions options);

}  // namespace cie::executor
