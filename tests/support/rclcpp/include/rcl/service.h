#pragma once

#include <functional>
#include <memory>

#include <rcl/event_callback.h>
#include <rcl/types.h>
#include <rmw/types.h>
#include <rmw_double/bus.hpp>

struct rcl_service_t : rmw_double::OwnedReader {
  using OwnedReader::OwnedReader;
  std::function<void(const void* from, void* to)> copy{};
  // As rcl_service_fini() does; rcl's state machine calls it for the services of a lifecycle node.
  void fini() { has_ended = true; }
  bool has_ended = false;
};

rcl_ret_t rcl_take_request_with_info(const rcl_service_t* service, rmw_service_info_t* info,
                                     void* request);
rcl_ret_t rcl_service_set_on_new_request_callback(const rcl_service_t* service,
                                                  rcl_event_callback_t callback,
                                                  const void* user_data);
