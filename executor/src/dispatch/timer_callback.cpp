#include "timer_callback.hpp"

#include <mutex>
#include <utility>

namespace cie {

namespace executor {

TimerCallback::TimerCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info,
                             std::int64_t interval_ns, std::function<void()> function,
                             const TimerOptions& options)
    : Callback(std::move(group), info),
      function_(std::move(function)),
      is_one_shot_(info.period_ns == 0),
      phase_ns_(options.phase ? options.phase->count() : interval_ns),
      schedule_(interval_ns) {
  if (options.start) start_ns_ = options.start->count();
}

// Time runs from the first serving on, so that a slow start-up is not counted as missed periods. A
// later serving keeps the grid: what fell between was missed.
void TimerCallback::serve(ReadySink* sink) {
  const std::lock_guard lock{mutex_};
  sink_ = sink;
  if (sink == nullptr || is_begun_ || is_cancelled_) return;
  is_begun_ = true;
  const std::int64_t now = monotonic_now();
  if (start_ns_) {
    schedule_.start_on_grid(*start_ns_, now);
  } else {
    schedule_.start_at(scheduling::later(now, phase_ns_));
  }
}

// The thread may wake once more at the expiry that was; it finds nothing due.
void TimerCallback::cancel() {
  const std::lock_guard lock{mutex_};
  is_cancelled_ = true;
  schedule_.start_at(kNever);
}

void TimerCallback::reset() {
  const std::lock_guard lock{mutex_};
  is_cancelled_ = false;
  if (sink_ == nullptr && !is_begun_) return;  // its time begins when it is served
  is_begun_ = true;
  schedule_.start_at(scheduling::later(monotonic_now(), schedule_.period_ns()));
  if (sink_ != nullptr) sink_->on_ready(*this);  // whoever waits, waits for another expiry
}

bool TimerCallback::is_cancelled() const {
  const std::lock_guard lock{mutex_};
  return is_cancelled_;
}

void TimerCallback::dispose() noexcept { function_ = nullptr; }

bool TimerCallback::run_one() {
  const auto release =
      is_one_shot_ ? schedule_.take_last(monotonic_now()) : schedule_.take(monotonic_now());
  if (!release) return false;
  const Instance instance{
      *this,
      {.kind = ReleaseKind::timer, .release_ns = release->expiry_ns, .missed = release->missed}};
  function_();
  return true;
}

}  // namespace executor

void Timer::cancel() { callback_->cancel(); }
void Timer::reset() { callback_->reset(); }
bool Timer::is_cancelled() const { return callback_->is_cancelled(); }
std::chrono::nanoseconds Timer::period() const noexcept {
  return std::chrono::nanoseconds{callback_->period_ns()};
}

}  // namespace cie
