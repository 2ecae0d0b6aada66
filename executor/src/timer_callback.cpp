#include "timer_callback.hpp"

#include <utility>

namespace cie {

namespace executor {

TimerCallback::TimerCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info,
                             std::function<void()> function, const TimerOptions& options)
    : Callback(std::move(group), info),
      function_(std::move(function)),
      phase_ns_(options.phase ? options.phase->count() : static_cast<std::int64_t>(info.period_ns)),
      schedule_(static_cast<std::int64_t>(info.period_ns)) {
  if (options.start) start_ns_ = options.start->count();
}

// Time runs from the first serving on, so that a slow start-up is not counted as missed periods. A
// later serving keeps the grid: what fell between was missed.
void TimerCallback::serve(ReadySink* sink) {
  if (sink == nullptr || schedule_.is_started()) return;
  const std::int64_t now = monotonic_now();
  if (start_ns_) {
    schedule_.start_on_grid(*start_ns_, now);
  } else {
    schedule_.start_at(now + phase_ns_);
  }
}

bool TimerCallback::execute_one() {
  const auto release = schedule_.take(monotonic_now());
  if (!release) return false;
  const Instance instance{
      *this,
      {.kind = ReleaseKind::timer, .release_ns = release->expiry_ns, .missed = release->missed}};
  function_();
  return true;
}

}  // namespace executor

const std::string& Timer::logical_id() const noexcept { return callback_->logical_id(); }
CallbackId Timer::id() const noexcept { return callback_->id(); }
std::chrono::nanoseconds Timer::period() const noexcept {
  return std::chrono::nanoseconds{callback_->period_ns()};
}

}  // namespace cie
