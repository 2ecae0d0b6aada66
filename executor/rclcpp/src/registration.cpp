#include "registration.hpp"

namespace cie_rclcpp {

LostMessages::LostMessages(std::shared_ptr<rcl_subscription_t> subscription, Entity::Notice notice)
    : subscription_(std::move(subscription)), notice_(std::move(notice)) {
  has_event_ = rcl_subscription_event_init(&event_, subscription_.get(),
                                           RCL_SUBSCRIPTION_MESSAGE_LOST) == RCL_RET_OK &&
               rcl_event_set_callback(&event_, &LostMessages::on_lost, this) == RCL_RET_OK;
  if (!has_event_) rcl_reset_error();  // a middleware that does not tell
}

LostMessages::~LostMessages() {
  if (has_event_ && rcl_event_set_callback(&event_, nullptr, nullptr) != RCL_RET_OK) {
    rcl_reset_error();
  }
  if (rcl_event_fini(&event_) != RCL_RET_OK) rcl_reset_error();
}

std::uint32_t LostMessages::take() noexcept {
  rmw_message_lost_status_t status{};
  if (!has_event_) return 0;
  if (rcl_take_event(&event_, &status) != RCL_RET_OK) {
    rcl_reset_error();
    return 0;
  }
  return static_cast<std::uint32_t>(status.total_count_change);
}

// Under rmw's lock: nothing of rmw may be called here.
void LostMessages::on_lost(const void* self, std::size_t count) {
  static_cast<const LostMessages*>(self)->notice_(Inbox::Source::lost, count, 0);
}

}  // namespace cie_rclcpp
