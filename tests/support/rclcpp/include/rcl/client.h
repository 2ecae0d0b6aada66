#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include <rcl/event_callback.h>
#include <rcl/types.h>
#include <rmw/types.h>
#include <rmw_double/bus.hpp>

struct rcl_client_t : rmw_double::OwnedReader {
  using OwnedReader::OwnedReader;
  std::uint64_t gid = 0;
  std::function<void(const void* from, void* to)> copy{};
};

// What it finds of other clients' is gone.
rcl_ret_t rcl_take_response_with_info(const rcl_client_t* client, rmw_service_info_t* info,
                                      void* response);
rcl_ret_t rcl_client_set_on_new_response_callback(const rcl_client_t* client,
                                                  rcl_event_callback_t callback,
                                                  const void* user_data);
