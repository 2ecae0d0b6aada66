// What callbacks told the tracer of their releases.
#pragma once

#include <cie/tracepoints/trace.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace cie_rclcpp::test {

// Of all instances that began in this process since the last call of forget_releases(), in order.
std::vector<cie::trace::Callback::Release> releases_of(cie::CallbackId callback);
void forget_releases();
// In this process so far.
std::size_t instances_begun();

}  // namespace cie_rclcpp::test
