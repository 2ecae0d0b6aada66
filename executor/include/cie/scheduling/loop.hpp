// What a thread of an executor does all day.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/cancellation.hpp>
#include <cie/scheduling/failure.hpp>

#include <cstdint>
#include <exception>
#include <memory>
#include <utility>
#include <vector>

namespace cie::scheduling {

// What an executor lends to its loops, which it outlives.
struct LoopParts {
  FailureHandler& failures;
  const Cancellation& cancellation;
};

// Serves a set of callbacks on the threads that call run(). Everything else may be called from any
// thread while they do.
class Loop {
 public:
  Loop() = default;
  Loop(const Loop&) = delete;
  Loop& operator=(const Loop&) = delete;
  virtual ~Loop() = default;
  virtual void add(std::shared_ptr<Callback> callback) = 0;
  // Returns when none of them runs or will run; not from a thread of this loop.
  virtual void remove(const std::vector<std::shared_ptr<Callback>>& callbacks) = 0;
  // None of them will run any more; one that runs, runs on, and is let go of then. Any thread.
  virtual void abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) = 0;
  // Serves until stop(), until its executor is cancelled, or until `deadline_ns` of CLOCK_MONOTONIC.
  virtual void run(std::int64_t deadline_ns) = 0;
  // Makes every run() return after the callback it is in, for good.
  virtual void stop() noexcept = 0;
  // Has every run() look whether it is cancelled. Async-signal-safe in OneThreadLoop.
  virtual void wake() noexcept = 0;
  virtual bool is_on_own_thread() const noexcept = 0;
};

// Runs one instance; true if there was one. What the user's function throws is handed over
// to `parts.failures` whole, so that those who are told of it free it.
inline bool execute(Callback& callback, const LoopParts& parts) noexcept {
  std::exception_ptr failure;
  try {
    return callback.execute_one(&parts.cancellation);
  } catch (...) {
    failure = std::current_exception();
  }
  parts.failures.on_failure({.callback = callback.id(),
                             .logical_id = callback.logical_id(),
                             .exception = std::move(failure)});
  callback.on_failure_handled();
  return true;
}

}  // namespace cie::scheduling
