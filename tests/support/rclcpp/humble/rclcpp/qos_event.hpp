#pragma once

#include <rclcpp/double_events.hpp>
