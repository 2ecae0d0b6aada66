#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include <rcl/types.h>
#include <rclcpp/macros.hpp>
#include <rclcpp/version.h>

namespace rclcpp {

#if RCLCPP_VERSION_MAJOR < 28
using ToWaitSet = rcl_wait_set_t*;
using OfWaitSet = rcl_wait_set_t*;
using TakenData = std::shared_ptr<void>&;
#else
using ToWaitSet = rcl_wait_set_t&;
using OfWaitSet = const rcl_wait_set_t&;
using TakenData = const std::shared_ptr<void>&;
#endif

class Waitable {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Waitable)
  Waitable() = default;
  Waitable(const Waitable&) = delete;
  Waitable& operator=(const Waitable&) = delete;
  virtual ~Waitable() = default;

  virtual void add_to_wait_set(ToWaitSet wait_set) = 0;
  virtual bool is_ready(OfWaitSet wait_set) = 0;
  virtual std::shared_ptr<void> take_data() = 0;
  virtual void execute(TakenData data) = 0;
  // These throw where a derived class does not know better.
  virtual std::shared_ptr<void> take_data_by_entity_id(std::size_t id);
  virtual void set_on_ready_callback(std::function<void(std::size_t, int)> callback);
  virtual void clear_on_ready_callback();
};

}  // namespace rclcpp
