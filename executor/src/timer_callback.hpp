// A timer as a callback.
#pragma once

#include <cie/executor/timer.hpp>

#include "callback.hpp"
#include "timer_schedule.hpp"

#include <functional>

namespace cie::executor {

class TimerCallback final : public Callback {
 public:
  TimerCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info,
                std::function<void()> function, const TimerOptions& options);
  bool execute_one() override;
  std::int64_t next_due() const noexcept override { return schedule_.next_due(); }
  void serve(ReadySink* sink) override;
  bool has_queue() const noexcept override { return false; }
  bool has_timer() const noexcept override { return true; }
  std::int64_t period_ns() const noexcept { return schedule_.period_ns(); }

 private:
  std::function<void()> function_;
  std::optional<std::int64_t> start_ns_;
  std::int64_t phase_ns_;
  TimerSchedule schedule_;
};

}  // namespace cie::executor
