#pragma once

#include <map>
#include <memory>
#include <mutex>

#include <rcl/event_callback.h>
#include <rcl/types.h>
#include <rmw/types.h>
#include <rmw_double/bus.hpp>

struct rcl_subscription_t : rmw_double::OwnedReader {
  using OwnedReader::OwnedReader;
  std::mutex mutex{};  // of what follows
  std::map<const void*, std::shared_ptr<const void>> loans{};
};

rcl_ret_t rcl_take_loaned_message(const rcl_subscription_t* subscription, void** message,
                                  rmw_message_info_t* info, void* allocation);
rcl_ret_t rcl_return_loaned_message_from_subscription(const rcl_subscription_t* subscription,
                                                      void* message);
rcl_ret_t rcl_subscription_set_on_new_message_callback(const rcl_subscription_t* subscription,
                                                       rcl_event_callback_t callback,
                                                       const void* user_data);
