#include <cie/executor/callback_handle.hpp>

#include "client_callback.hpp"
#include "guard_condition_callback.hpp"
#include "node_state.hpp"
#include "service_callback.hpp"
#include "subscription_callback.hpp"
#include "timer_callback.hpp"

namespace cie::executor {

template <typename Kind>
const std::string& CallbackHandle<Kind>::logical_id() const noexcept {
  return callback_->logical_id();
}

template <typename Kind>
CallbackId CallbackHandle<Kind>::id() const noexcept {
  return callback_->id();
}

template <typename Kind>
void CallbackHandle<Kind>::remove_from(NodeState& node) const {
  node.remove(*callback_);
}

template class CallbackHandle<TimerCallback>;
template class CallbackHandle<GuardConditionCallback>;
template class CallbackHandle<SubscriptionCallback>;
template class CallbackHandle<ServiceCallback>;
template class CallbackHandle<ClientCallback>;

}  // namespace cie::executor
