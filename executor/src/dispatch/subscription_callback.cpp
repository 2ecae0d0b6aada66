#include "subscription_callback.hpp"

namespace cie::executor {

void SubscriptionCallback::dispose() noexcept {
  ReaderCallback::dispose();
  function_ = nullptr;
}

bool SubscriptionCallback::run_one() {
  return run_next([this](const MessagePool::Loan& message, const MessageInfo& info) {
    const Instance instance{*this, release_by(info)};
    function_(message.handle(), info);
    return true;
  });
}

std::uint32_t matched_writers(const SubscriptionCallback& callback) {
  return callback.reader().matched();
}

}  // namespace cie::executor
