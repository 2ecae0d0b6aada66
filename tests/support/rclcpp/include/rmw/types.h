#pragma once

#include <cstddef>
#include <cstdint>

struct rmw_gid_t {
  std::uint64_t number;
};
struct rmw_message_info_t {
  std::int64_t source_timestamp;  // CLOCK_REALTIME
  std::int64_t received_timestamp;
  rmw_gid_t publisher_gid;
};
struct rmw_request_id_t {
  std::uint64_t client;  // the gid of who asks
  std::int64_t sequence_number;
};
struct rmw_service_info_t {
  std::int64_t source_timestamp;
  std::int64_t received_timestamp;
  rmw_request_id_t request_id;
};

struct rmw_message_lost_status_t {
  std::size_t total_count;
  std::size_t total_count_change;
};

enum class rmw_qos_history_policy_t { KeepLast, KeepAll };
enum class rmw_qos_reliability_policy_t { Reliable, BestEffort };
struct rmw_qos_profile_t {
  rmw_qos_history_policy_t history;
  std::size_t depth;
  rmw_qos_reliability_policy_t reliability;
};
inline constexpr rmw_qos_profile_t rmw_qos_profile_services_default{
    rmw_qos_history_policy_t::KeepLast, 10, rmw_qos_reliability_policy_t::Reliable};
