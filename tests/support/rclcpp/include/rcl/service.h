#pragma once

#include <functional>
#include <memory>

#include <rcl/types.h>
#include <rmw/types.h>
#include <rmw_double/bus.hpp>

struct rcl_service_t {
  std::shared_ptr<rmw_double::Reader> reader{};
  std::function<void(const void* from, void* to)> copy{};
};

rcl_ret_t rcl_take_request_with_info(const rcl_service_t* service, rmw_service_info_t* info,
                                     void* request);
