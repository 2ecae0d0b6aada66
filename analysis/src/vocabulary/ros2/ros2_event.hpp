// The events of ROS 2's tracers (ros2_tracing, CARET, agnocast) that say something about callbacks
// and messages, and the order of their fields. Distributions differ in which events and fields
// there are, so fields are asked for by name and may be absent.
#pragma once

#include <cstdint>

namespace cie::analysis::ros2 {

// Behind each: the fields in the order of their slots; procname is the context's. Handles are addresses in the process.
enum class Ros2Event : std::uint32_t {
  begin,                   // context_handle, version, procname
  node_init,               // node_handle, node_name, namespace
  publisher_init,          // publisher_handle, node_handle, topic_name, rmw_publisher_handle
  subscription_init,       // subscription_handle, node_handle, topic_name, queue_depth,
                           // rmw_subscription_handle
  subscription_object,     // subscription_handle, subscription
  subscription_callback,   // subscription, callback
  service_init,            // service_handle, node_handle, service_name, rmw_service_handle
  service_callback,        // service_handle, callback
  client_identity,         // rmw_client_handle, gid
  client_init,             // client_handle, node_handle, service_name, rmw_client_handle
  timer_init,              // timer_handle, period
  timer_callback,          // timer_handle, callback
  timer_node,              // timer_handle, node_handle
  callback_symbol,         // callback, symbol
  callback_start,          // callback, procname
  callback_end,            // callback
  publish,                 // message: the call of the user's code
  intra_publish,           // publisher_handle, message
  rcl_publish,             // publisher_handle, message
  rmw_publish,             // message; since Iron timestamp (of the source), rmw_publisher_handle
  bind_stamp,              // addr, source_stamp: CARET's word for a message's source timestamp
  rmw_take,                // rmw_subscription_handle, source_timestamp, taken
  send_request,            // rmw_client_handle, sequence_number
  take_request,            // rmw_service_handle, client_gid, sequence_number, taken
  send_response,           // rmw_service_handle, client_gid, sequence_number, timestamp
  take_response,           // rmw_client_handle, taken, sequence_number, source_timestamp
  dispatch,                // callback, source_stamp: CARET's take
  intra_dispatch,          // message, callback: CARET's take between callbacks of a process
  message_copy,            // original_message, constructed_message
  executor_wait,           // timeout
  executor_ready,          //
  buffer_of_object,        // buffer, ipb
  object_of_subscription,  // ipb, subscription
  enqueue,                 // buffer, index, overwritten
  dequeue,                 // buffer, index
  executor,                // executor_addr, executor_type_name
  group,                   // callback_group_addr, group_type_name, executor_addr
  group_member,            // callback_group_addr, handle
  agnocast_subscription,   // subscription_handle, node_handle, callback_group, symbol, topic_name,
                           // queue_depth, pid_callback_info_id
  agnocast_timer,          // timer_handle, node_handle, callback_group, symbol, period
  agnocast_publish,        // publisher_handle, entry_id
  agnocast_callable,       // callable, entry_id, pid_callback_info_id
  agnocast_timer_callable  // callable, timer_handle
};

// Nodes, and what they publish, take and are called back by.
constexpr bool describes_entities(Ros2Event event) noexcept {
  return event >= Ros2Event::node_init && event <= Ros2Event::timer_node;
}

// Translation::kind: the event, and whether a tracer tells it that repeats others' events when a
// recording begins; then also the slot in which it says when that was (init_timestamp).
inline constexpr std::uint32_t kRepeats = 1U << 16U;
inline constexpr std::uint32_t kMadeShift = 17;
inline Ros2Event event_of(std::uint32_t kind) noexcept {
  return static_cast<Ros2Event>(kind & (kRepeats - 1));
}

}  // namespace cie::analysis::ros2
