#include "guard_condition_callback.hpp"

#include <utility>

namespace cie {
namespace executor {

GuardConditionCallback::GuardConditionCallback(std::shared_ptr<GroupState> group,
                                               trace::CallbackInfo info,
                                               std::function<void()> function)
    : Callback(std::move(group), std::move(info)), function_(std::move(function)) {}

// Atomics, a tracepoint and what the sink does: no lock, so it may interrupt itself.
void GuardConditionCallback::trigger() noexcept {
  triggering_.enter();
  std::int64_t expected = kNone;
  if (!is_closed() && triggered_ns_.compare_exchange_strong(expected, monotonic_now())) {
    trace().release(0);
    if (ReadySink* const sink = sink_.load()) sink->on_ready(*this);
  }  // else one waits already
  triggering_.leave();
}

void GuardConditionCallback::serve(ReadySink* sink) {
  sink_.store(sink);
  if (sink != nullptr) {
    sink->on_ready(*this);  // for what was triggered before
    return;
  }
  triggering_.wait_for_none();
}

void GuardConditionCallback::dispose() noexcept { function_ = nullptr; }

bool GuardConditionCallback::run_one() {
  const std::int64_t triggered = triggered_ns_.exchange(kNone);
  if (triggered == kNone) return false;
  const Instance instance{*this, {.kind = ReleaseKind::data, .release_ns = triggered}};
  function_();
  return true;
}

}  // namespace executor

void GuardCondition::trigger() noexcept { callback_->trigger(); }

}  // namespace cie
