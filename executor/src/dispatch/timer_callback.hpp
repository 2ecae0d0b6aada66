// A timer as a callback.
#pragma once

#include <cie/executor/timer.hpp>
#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/timer_schedule.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "scheduling_names.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

namespace cie::executor {

class TimerCallback final : public Callback {
 public:
  // `interval_ns`: the period, or the delay of a one-shot timer, whose info has no period.
  TimerCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info,
                std::int64_t interval_ns, std::function<void()> function,
                const TimerOptions& options);
  ~TimerCallback() override { end(); }

  std::int64_t next_due() const noexcept override { return schedule_.next_due(); }
  void serve(ReadySink* sink) override;
  bool has_queue() const noexcept override { return false; }
  bool has_timer() const noexcept override { return true; }

  void cancel();
  void reset();
  bool is_cancelled() const;
  std::int64_t period_ns() const noexcept { return schedule_.period_ns(); }

 private:
  bool run_one() override;
  void dispose() noexcept override;

  std::function<void()> function_;
  bool is_one_shot_;
  std::optional<std::int64_t> start_ns_;
  std::int64_t phase_ns_;
  TimerSchedule schedule_;
  mutable PriorityMutex mutex_;  // of what follows, and of starting and stopping the schedule
  ReadySink* sink_ = nullptr;
  bool is_begun_ = false;  // its time runs, or has ended
  bool is_cancelled_ = false;
};

}  // namespace cie::executor
