#pragma once

#include <cstddef>
#include <memory>

#include <rcl/event_callback.h>
#include <rcl/subscription.h>
#include <rmw/types.h>

enum rcl_subscription_event_type_t {
  RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
  RCL_SUBSCRIPTION_MESSAGE_LOST
};
struct rcl_event_t {
  std::shared_ptr<rmw_double::Event> impl;
};

inline rcl_event_t rcl_get_zero_initialized_event() { return {}; }
// Of lost messages, which is the one that is asked for here.
rcl_ret_t rcl_subscription_event_init(rcl_event_t* event, const rcl_subscription_t* subscription,
                                      rcl_subscription_event_type_t type);
rcl_ret_t rcl_event_set_callback(const rcl_event_t* event, rcl_event_callback_t callback,
                                 const void* user_data);
rcl_ret_t rcl_take_event(const rcl_event_t* event, void* status);
rcl_ret_t rcl_event_fini(rcl_event_t* event);
