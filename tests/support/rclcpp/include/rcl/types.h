#pragma once

#include <memory>

using rcl_ret_t = int;
inline constexpr rcl_ret_t RCL_RET_OK = 0;
inline constexpr rcl_ret_t RCL_RET_ERROR = 1;
inline constexpr rcl_ret_t RCL_RET_INVALID_ARGUMENT = 11;
inline constexpr rcl_ret_t RCL_RET_SUBSCRIPTION_TAKE_FAILED = 401;
inline constexpr rcl_ret_t RCL_RET_CLIENT_TAKE_FAILED = 501;
inline constexpr rcl_ret_t RCL_RET_SERVICE_TAKE_FAILED = 601;
inline constexpr rcl_ret_t RCL_RET_TIMER_CANCELED = 801;

struct rcl_arguments_impl_t;
struct rcl_arguments_t {
  std::shared_ptr<const rcl_arguments_impl_t> impl;
};
struct rcl_context_t {
  rcl_arguments_t global_arguments;
};
struct rcl_wait_set_t;  // nobody waits with one here
