// What a thread of an executor does all day.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include "callback.hpp"

#include <cstdint>
#include <exception>
#include <memory>
#include <utility>
#include <vector>

namespace cie::executor {

// Told when a callback ended by an exception. From the callback's thread; must not throw.
class FailureSink {
 public:
  FailureSink() = default;
  FailureSink(const FailureSink&) = delete;
  FailureSink& operator=(const FailureSink&) = delete;
  virtual ~FailureSink() = default;
  virtual void on_failure(Callback& callback, std::exception_ptr exception) noexcept = 0;
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
  // Serves until stop() or until `deadline_ns` of CLOCK_MONOTONIC.
  virtual void run(std::int64_t deadline_ns) = 0;
  // Makes every run() return after the callback it is in. Async-signal-safe in OneThreadLoop.
  virtual void stop() noexcept = 0;
  // Undoes stop(), while no thread runs the loop.
  virtual void resume() noexcept = 0;
  virtual bool is_on_own_thread() const noexcept = 0;
};

// Runs one instance; true if there was one. What the user's function throws is handed over
// to `failures` whole, so that those who are told of it free it.
inline bool execute(Callback& callback, FailureSink& failures) noexcept {
  std::exception_ptr failure;
  try {
    return callback.execute_one();
  } catch (...) {
    failure = std::current_exception();
  }
  failures.on_failure(callback, std::move(failure));
  return true;
}

}  // namespace cie::executor
