#include "ros2_event.hpp"
#include "vocabulary/vocabulary.hpp"

#include <algorithm>
#include <initializer_list>
#include <string_view>
#include <utility>

namespace cie::analysis {
namespace {

using ros2::Ros2Event;

void add(std::vector<Translation>& table, Ros2Event event,
         std::initializer_list<std::string_view> names, const std::vector<FieldRequest>& fields,
         bool has_thread_name = false) {
  for (const auto name : names) {
    auto& translation =
        table.emplace_back(Translation{name, fields, nullptr, static_cast<std::uint32_t>(event),
                                       has_thread_name, event == Ros2Event::callback_start});
    if (!name.starts_with("ros2_caret:")) continue;
    translation.kind |= ros2::kRepeats;
    if (has_thread_name) continue;  // a process's begin, which is of no address
    translation.kind |= static_cast<std::uint32_t>(fields.size()) << ros2::kMadeShift;
    translation.fields.emplace_back("init_timestamp");
  }
}

// The same with what the tracer calls the thread, in the last slot.
void add_named(std::vector<Translation>& table, Ros2Event event,
               std::initializer_list<std::string_view> names, std::vector<FieldRequest> fields) {
  fields.emplace_back("procname");
  add(table, event, names, fields, true);
}

void add_entities(std::vector<Translation>& table) {
  add_named(table, Ros2Event::begin, {"ros2:rcl_init", "ros2_caret:rcl_init"},
            {"context_handle", "version"});
  add(table, Ros2Event::node_init,
      {"ros2:rcl_node_init", "ros2_caret:rcl_node_init", "agnocast:agnocast_node_init",
       "ros2_caret:agnocast_node_init"},
      {needed("node_handle"), "node_name", "namespace"});
  add(table, Ros2Event::publisher_init,
      {"ros2:rcl_publisher_init", "ros2_caret:rcl_publisher_init",
       "agnocast:agnocast_publisher_init", "ros2_caret:agnocast_publisher_init"},
      {needed("publisher_handle"), needed("node_handle"), "topic_name", "rmw_publisher_handle"});
  add(table, Ros2Event::subscription_init,
      {"ros2:rcl_subscription_init", "ros2_caret:rcl_subscription_init"},
      {needed("subscription_handle"), needed("node_handle"), "topic_name", "queue_depth",
       "rmw_subscription_handle"});
  add(table, Ros2Event::subscription_object,
      {"ros2:rclcpp_subscription_init", "ros2_caret:rclcpp_subscription_init"},
      {needed("subscription_handle"), needed("subscription")});
  add(table, Ros2Event::subscription_callback,
      {"ros2:rclcpp_subscription_callback_added", "ros2_caret:rclcpp_subscription_callback_added"},
      {needed("subscription"), needed("callback")});
  add(table, Ros2Event::service_init, {"ros2:rcl_service_init", "ros2_caret:rcl_service_init"},
      {needed("service_handle"), needed("node_handle"), "service_name", "rmw_service_handle"});
  add(table, Ros2Event::service_callback,
      {"ros2:rclcpp_service_callback_added", "ros2_caret:rclcpp_service_callback_added"},
      {needed("service_handle"), needed("callback")});
  add(table, Ros2Event::client_identity, {"ros2:rmw_client_init"},
      {needed("rmw_client_handle"), "gid"});
  add(table, Ros2Event::client_init, {"ros2:rcl_client_init", "ros2_caret:rcl_client_init"},
      {needed("client_handle"), needed("node_handle"), "service_name", "rmw_client_handle"});
  add(table, Ros2Event::timer_init, {"ros2:rcl_timer_init", "ros2_caret:rcl_timer_init"},
      {needed("timer_handle"), needed("period")});
  add(table, Ros2Event::timer_callback,
      {"ros2:rclcpp_timer_callback_added", "ros2_caret:rclcpp_timer_callback_added"},
      {needed("timer_handle"), needed("callback")});
  add(table, Ros2Event::timer_node,
      {"ros2:rclcpp_timer_link_node", "ros2_caret:rclcpp_timer_link_node"},
      {needed("timer_handle"), needed("node_handle")});
  add(table, Ros2Event::callback_symbol,
      {"ros2:rclcpp_callback_register", "ros2_caret:rclcpp_callback_register"},
      {needed("callback"), "symbol"});
  add(table, Ros2Event::executor, {"ros2_caret:construct_executor"},
      {needed("executor_addr"), "executor_type_name"});
  add(table, Ros2Event::group,
      {"ros2_caret:add_callback_group", "ros2_caret:add_callback_group_static_executor",
       "ros2_caret:callback_group_to_executor_entity_collector",
       "agnocast:agnocast_add_callback_group", "ros2_caret:agnocast_add_callback_group"},
      {needed("callback_group_addr"), "group_type_name", "executor_addr"});
  add(table, Ros2Event::group_member,
      {"ros2_caret:callback_group_add_timer", "ros2_caret:callback_group_add_subscription",
       "ros2_caret:callback_group_add_service", "ros2_caret:callback_group_add_client"},
      {needed("callback_group_addr"),
       needed("timer_handle|subscription_handle|service_handle|client_handle")});
}

void add_running(std::vector<Translation>& table) {
  add_named(table, Ros2Event::callback_start,
            {"ros2:callback_start", "agnocast:agnocast_callable_start"},
            {needed("callback|callable"), "is_intra_process"});
  add(table, Ros2Event::callback_end, {"ros2:callback_end", "agnocast:agnocast_callable_end"},
      {needed("callback|callable")});
  add(table, Ros2Event::publish, {"ros2:rclcpp_publish"}, {needed("message")});
  add(table, Ros2Event::intra_publish, {"ros2:rclcpp_intra_publish"},
      {needed("publisher_handle"), needed("message")});
  add(table, Ros2Event::rcl_publish, {"ros2:rcl_publish"},
      {needed("publisher_handle"), needed("message")});
  add(table, Ros2Event::rmw_publish, {"ros2:rmw_publish"},
      {needed("message"), "timestamp", "rmw_publisher_handle"});
  add(table, Ros2Event::bind_stamp, {"ros2_caret:dds_bind_addr_to_stamp"},
      {needed("addr"), needed("source_stamp")});
  add(table, Ros2Event::rmw_take, {"ros2:rmw_take"},
      {needed("rmw_subscription_handle"), needed("source_timestamp"), needed("taken")});
  add(table, Ros2Event::send_request, {"ros2:rmw_send_request"},
      {needed("rmw_client_handle"), needed("sequence_number")});
  add(table, Ros2Event::take_request, {"ros2:rmw_take_request"},
      {needed("rmw_service_handle"), "client_gid", needed("sequence_number"), needed("taken")});
  add(table, Ros2Event::send_response, {"ros2:rmw_send_response"},
      {needed("rmw_service_handle"), "client_gid", needed("sequence_number"), "timestamp"});
  add(table, Ros2Event::take_response, {"ros2:rmw_take_response"},
      {needed("rmw_client_handle"), needed("taken"), needed("sequence_number"),
       needed("source_timestamp")});
  add(table, Ros2Event::dispatch, {"ros2:dispatch_subscription_callback"},
      {needed("callback"), "source_stamp|source_timestamp"});
  add(table, Ros2Event::intra_dispatch, {"ros2:dispatch_intra_process_subscription_callback"},
      {needed("message"), needed("callback")});
  add(table, Ros2Event::message_copy, {"ros2:message_construct"},
      {needed("original_message"), needed("constructed_message")});
  add(table, Ros2Event::executor_wait, {"ros2:rclcpp_executor_wait_for_work"}, {"timeout"});
  add(table, Ros2Event::executor_ready, {"ros2:rclcpp_executor_get_next_ready"}, {});
}

void add_intra_process(std::vector<Translation>& table) {
  add(table, Ros2Event::buffer_of_object,
      {"ros2:rclcpp_buffer_to_ipb", "ros2_caret:rclcpp_buffer_to_ipb"},
      {needed("buffer"), needed("ipb")});
  add(table, Ros2Event::object_of_subscription,
      {"ros2:rclcpp_ipb_to_subscription", "ros2_caret:rclcpp_ipb_to_subscription"},
      {needed("ipb"), needed("subscription")});
  add(table, Ros2Event::enqueue, {"ros2:rclcpp_ring_buffer_enqueue"},
      {needed("buffer"), "index", "overwritten"});
  add(table, Ros2Event::dequeue, {"ros2:rclcpp_ring_buffer_dequeue"}, {needed("buffer"), "index"});
}

void add_agnocast(std::vector<Translation>& table) {
  add(table, Ros2Event::agnocast_subscription,
      {"agnocast:agnocast_subscription_init", "ros2_caret:agnocast_subscription_init"},
      {needed("subscription_handle"), needed("node_handle"), "callback_group", "symbol",
       "topic_name", "queue_depth", "pid_callback_info_id|pid_ciid"});
  add(table, Ros2Event::agnocast_timer,
      {"agnocast:agnocast_timer_init", "ros2_caret:agnocast_timer_init"},
      {needed("timer_handle"), needed("node_handle"), "callback_group", "symbol",
       needed("period")});
  add(table, Ros2Event::agnocast_publish, {"agnocast:agnocast_publish"},
      {needed("publisher_handle"), needed("entry_id")});
  add(table, Ros2Event::agnocast_callable, {"agnocast:agnocast_create_callable"},
      {needed("callable"), needed("entry_id"), "pid_callback_info_id|pid_ciid"});
  add(table, Ros2Event::agnocast_timer_callable, {"agnocast:agnocast_create_timer_callable"},
      {needed("callable"), needed("timer_handle")});
}

std::vector<Translation> ros2_table() {
  std::vector<Translation> table;
  add_entities(table);
  add_running(table);
  add_intra_process(table);
  add_agnocast(table);
  return table;
}

// Of any of the tracers.
bool is_called(std::string_view name, Ros2Event event) {
  return std::ranges::any_of(ros2_vocabulary(), [&](const Translation& translation) {
    return translation.event == name && ros2::event_of(translation.kind) == event;
  });
}

}  // namespace

const std::vector<Translation>& ros2_vocabulary() {
  static const auto table = ros2_table();
  return table;
}

bool is_client_init(std::string_view event) { return is_called(event, Ros2Event::client_init); }

bool is_service_init(std::string_view event) { return is_called(event, Ros2Event::service_init); }

}  // namespace cie::analysis
