// A callback that the program itself makes ready.
#pragma once

#include <cie/executor/guard_condition.hpp>
#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/clock.hpp>

#include "calls_in_progress.hpp"
#include "scheduling_names.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>

namespace cie::executor {

class GuardConditionCallback final : public Callback {
 public:
  GuardConditionCallback(std::shared_ptr<GroupState> group, trace::CallbackInfo info,
                         std::function<void()> function);
  ~GuardConditionCallback() override { end(); }

  void trigger() noexcept;
  std::int64_t next_due() const noexcept override { return kNever; }
  void serve(ReadySink* sink) override;
  bool has_queue() const noexcept override { return false; }  // each trigger tells the sink

 private:
  bool run_one() override;
  void dispose() noexcept override;

  static constexpr std::int64_t kNone = 0;

  std::function<void()> function_;
  std::atomic<std::int64_t> triggered_ns_{kNone};  // the trigger that waits for its instance
  std::atomic<ReadySink*> sink_{nullptr};
  CallsInProgress triggering_;  // calls of trigger() that may use the sink
};

}  // namespace cie::executor
