#include "message_pool.hpp"

namespace cie::executor {

MessagePool::MessageHandle MessagePool::borrow() {
  auto expected = Spare::there;
  if (!state_.compare_exchange_strong(expected, Spare::moving, std::memory_order_acquire)) {
    return make();
  }
  MessageHandle message = std::move(spare_);
  state_.store(Spare::loaned, std::memory_order_release);
  return message;
}

void MessagePool::give_back(MessageHandle message) noexcept {
  if (message.use_count() != 1) return;  // the user kept it
  // Nobody can come by another reference now. Taking and dropping one makes the reads of whoever
  // dropped the last one precede the reuse (use_count() alone orders nothing).
  MessageHandle{message}.reset();
  auto expected = Spare::loaned;
  if (!state_.compare_exchange_strong(expected, Spare::moving, std::memory_order_acquire)) return;
  spare_ = std::move(message);
  state_.store(Spare::there, std::memory_order_release);
}

}  // namespace cie::executor
