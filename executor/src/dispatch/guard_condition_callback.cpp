#include "guard_condition_callback.hpp"

#include <chrono>
#include <thread>
#include <utility>

namespace cie {
namespace executor {

GuardConditionCallback::GuardConditionCallback(std::shared_ptr<GroupState> group,
                                               trace::CallbackInfo info,
                                               std::function<void()> function)
    : Callback(std::move(group), std::move(info)), function_(std::move(function)) {}

// Atomics, a tracepoint and what the sink does: no lock, so it may interrupt itself.
void GuardConditionCallback::trigger() noexcept {
  triggering_.fetch_add(1);
  std::int64_t expected = kNone;
  if (!is_closed() && triggered_ns_.compare_exchange_strong(expected, monotonic_now())) {
    trace().release(0);
    if (ReadySink* const sink = sink_.load()) sink->on_ready(*this);
  }  // else one waits already
  triggering_.fetch_sub(1);
}

// What trigger() does between its two counts is short; but it may have been preempted there by this
// very thread, so waiting means sleeping.
void GuardConditionCallback::serve(ReadySink* sink) {
  sink_.store(sink);
  if (sink != nullptr) {
    sink->on_ready(*this);  // for what was triggered before
    return;
  }
  while (triggering_.load() != 0)
    std::this_thread::sleep_for(std::chrono::microseconds{50});
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
