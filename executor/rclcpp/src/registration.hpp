// What the middleware calls, and until when.
#pragma once

#include "entity.hpp"

#include <cstdint>
#include <memory>
#include <utility>

#include <rcl/error_handling.h>
#include <rcl/event.h>
#include <rcl/subscription.h>

namespace cie_rclcpp {

// Part of the function that an entity of rclcpp has the middleware call. Since Jazzy that function ends with
// the entity, and nobody says so to the middleware, whose reader lives on where somebody else has rcl's
// handle: every handler of the entity's events does. So it keeps the handle itself, and with the function it
// ends the calls, before the handle can go. When it has gone, none is running.
template <typename Handle>
class Registration {
 public:
  using SetCallback = rcl_ret_t (*)(const Handle*, rcl_event_callback_t, const void*);

  Registration(std::shared_ptr<Handle> handle, SetCallback set_callback)
      : handle_(std::move(handle)), set_callback_(set_callback) {}
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;
  ~Registration() {
    if (set_callback_(handle_.get(), nullptr, nullptr) != RCL_RET_OK) rcl_reset_error();
  }

 private:
  const std::shared_ptr<Handle> handle_;
  const SetCallback set_callback_;
};

// Tells how many messages the middleware lost. Part of that function, too, and so of the subscription.
class LostMessages {
 public:
  LostMessages(std::shared_ptr<rcl_subscription_t> subscription, Entity::Notice notice);
  LostMessages(const LostMessages&) = delete;
  LostMessages& operator=(const LostMessages&) = delete;
  ~LostMessages();

  // How many since the last time.
  std::uint32_t take() noexcept;

 private:
  static void on_lost(const void* self, std::size_t count);

  const std::shared_ptr<rcl_subscription_t> subscription_;
  const Entity::Notice notice_;
  rcl_event_t event_ = rcl_get_zero_initialized_event();
  bool has_event_ = false;
};

}  // namespace cie_rclcpp
