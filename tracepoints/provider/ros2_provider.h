// The LTTng-UST provider `ros2` of the profile: events, fields and types of ROS 2's tracetools 8.2
// (Jazzy). ros2_provider.cpp includes it; together they are the one other place with LTTng's
// macros.
#pragma GCC system_header  // LTTng's macros do not survive this project's warnings

// clang-format off
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2

#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "provider/ros2_provider.h"

#if !defined(CIE_TRACEPOINTS_ROS2_PROVIDER_H) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define CIE_TRACEPOINTS_ROS2_PROVIDER_H

#ifndef LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_HIDDEN_DEFINITION
#endif
#ifndef LTTNG_UST_TRACEPOINT_PROVIDER_HIDDEN_DEFINITION
#define LTTNG_UST_TRACEPOINT_PROVIDER_HIDDEN_DEFINITION
#endif

#include <lttng/tracepoint.h>
#include <cstddef>
#include <cstdint>

#ifndef CIE_TRACEPOINTS_ROS2_GID
#define CIE_TRACEPOINTS_ROS2_GID
namespace cie::trace {
inline constexpr std::size_t kRos2GidSize = 24;  // bytes; 16 in later distributions
}
#endif

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, context_handle_, const char*, version_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, context_handle, context_handle_)
    lttng_ust_field_string(version, version_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_node_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, node_handle_, std::uint64_t, rmw_handle_, const char*,
                    node_name_, const char*, namespace_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, rmw_handle, rmw_handle_)
    lttng_ust_field_string(node_name, node_name_)
    lttng_ust_field_string(namespace, namespace_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_publisher_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, rmw_publisher_handle_, const std::uint8_t*, gid_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, rmw_publisher_handle, rmw_publisher_handle_)
    lttng_ust_field_array(std::uint8_t, gid, gid_, cie::trace::kRos2GidSize)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publisher_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, publisher_handle_, std::uint64_t, node_handle_, std::uint64_t,
                    rmw_publisher_handle_, const char*, topic_name_, std::uint64_t, queue_depth_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, publisher_handle, publisher_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, rmw_publisher_handle, rmw_publisher_handle_)
    lttng_ust_field_string(topic_name, topic_name_)
    lttng_ust_field_integer(std::uint64_t, queue_depth, queue_depth_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_publish,
  LTTNG_UST_TP_ARGS(std::uint64_t, message_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publish,
  LTTNG_UST_TP_ARGS(std::uint64_t, publisher_handle_, std::uint64_t, message_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, publisher_handle, publisher_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_publish,
  LTTNG_UST_TP_ARGS(std::uint64_t, rmw_publisher_handle_, std::uint64_t, message_, std::int64_t,
                    timestamp_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, rmw_publisher_handle, rmw_publisher_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
    lttng_ust_field_integer(std::int64_t, timestamp, timestamp_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_subscription_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, rmw_subscription_handle_, const std::uint8_t*, gid_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, rmw_subscription_handle, rmw_subscription_handle_)
    lttng_ust_field_array(std::uint8_t, gid, gid_, cie::trace::kRos2GidSize)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_subscription_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, subscription_handle_, std::uint64_t, node_handle_,
                    std::uint64_t, rmw_subscription_handle_, const char*, topic_name_,
                    std::uint64_t, queue_depth_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, subscription_handle, subscription_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, rmw_subscription_handle, rmw_subscription_handle_)
    lttng_ust_field_string(topic_name, topic_name_)
    lttng_ust_field_integer(std::uint64_t, queue_depth, queue_depth_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, subscription_handle_, std::uint64_t, subscription_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, subscription_handle, subscription_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, subscription, subscription_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_callback_added,
  LTTNG_UST_TP_ARGS(std::uint64_t, subscription_, std::uint64_t, callback_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, subscription, subscription_)
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_take,
  LTTNG_UST_TP_ARGS(std::uint64_t, rmw_subscription_handle_, std::uint64_t, message_,
                    std::int64_t, source_timestamp_, int, taken_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, rmw_subscription_handle, rmw_subscription_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
    lttng_ust_field_integer(std::int64_t, source_timestamp, source_timestamp_)
    lttng_ust_field_integer(int, taken, taken_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_take,
  LTTNG_UST_TP_ARGS(std::uint64_t, message_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_take,
  LTTNG_UST_TP_ARGS(std::uint64_t, message_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, message, message_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_service_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, service_handle_, std::uint64_t, node_handle_, std::uint64_t,
                    rmw_service_handle_, const char*, service_name_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, service_handle, service_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, rmw_service_handle, rmw_service_handle_)
    lttng_ust_field_string(service_name, service_name_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_service_callback_added,
  LTTNG_UST_TP_ARGS(std::uint64_t, service_handle_, std::uint64_t, callback_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, service_handle, service_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_client_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, client_handle_, std::uint64_t, node_handle_, std::uint64_t,
                    rmw_client_handle_, const char*, service_name_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, client_handle, client_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, rmw_client_handle, rmw_client_handle_)
    lttng_ust_field_string(service_name, service_name_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_timer_init,
  LTTNG_UST_TP_ARGS(std::uint64_t, timer_handle_, std::int64_t, period_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, timer_handle, timer_handle_)
    lttng_ust_field_integer(std::int64_t, period, period_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_callback_added,
  LTTNG_UST_TP_ARGS(std::uint64_t, timer_handle_, std::uint64_t, callback_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, timer_handle, timer_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_link_node,
  LTTNG_UST_TP_ARGS(std::uint64_t, timer_handle_, std::uint64_t, node_handle_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, timer_handle, timer_handle_)
    lttng_ust_field_integer_hex(std::uint64_t, node_handle, node_handle_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_callback_register,
  LTTNG_UST_TP_ARGS(std::uint64_t, callback_, const char*, symbol_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
    lttng_ust_field_string(symbol, symbol_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_start,
  LTTNG_UST_TP_ARGS(std::uint64_t, callback_, int, is_intra_process_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
    lttng_ust_field_integer(int, is_intra_process, is_intra_process_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_end,
  LTTNG_UST_TP_ARGS(std::uint64_t, callback_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, callback, callback_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_get_next_ready,
  LTTNG_UST_TP_ARGS(),
  LTTNG_UST_TP_FIELDS()
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_wait_for_work,
  LTTNG_UST_TP_ARGS(std::int64_t, timeout_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(std::int64_t, timeout, timeout_)
  )
)

LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_execute,
  LTTNG_UST_TP_ARGS(std::uint64_t, handle_),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(std::uint64_t, handle, handle_)
  )
)

#endif  // CIE_TRACEPOINTS_ROS2_PROVIDER_H

#include <lttng/tracepoint-event.h>
// clang-format on
