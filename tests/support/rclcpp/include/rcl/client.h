#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include <rcl/types.h>
#include <rmw/types.h>
#include <rmw_double/bus.hpp>

struct rcl_client_t {
  std::shared_ptr<rmw_double::Reader> reader{};
  std::uint64_t gid = 0;
  std::function<void(const void* from, void* to)> copy{};
};

// What it finds of other clients' is gone.
rcl_ret_t rcl_take_response_with_info(const rcl_client_t* client, rmw_service_info_t* info,
                                      void* response);
