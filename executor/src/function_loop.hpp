// A thread's work that is one function of the user's.
#pragma once

#include "loop.hpp"

#include <cassert>
#include <exception>
#include <functional>
#include <stop_token>
#include <utility>

namespace cie::executor {

// The loop of a worker thread: it serves no callbacks.
class FunctionLoop final : public Loop {
 public:
  using Function = std::function<void(std::stop_token)>;
  using FailureHandler = std::function<void(std::exception_ptr)>;

  // `on_failure` is told, on the worker's thread, what the function throws, and becomes its owner;
  // it must not throw.
  FunctionLoop(Function function, FailureHandler on_failure)
      : function_(std::move(function)), on_failure_(std::move(on_failure)) {}

  void run(std::int64_t) override {
    std::exception_ptr failure;
    try {
      function_(stop_.get_token());
    } catch (...) {
      failure = std::current_exception();
    }
    if (failure) on_failure_(std::move(failure));
  }
  void stop() noexcept override { stop_.request_stop(); }

  void resume() noexcept override { stop_ = std::stop_source{}; }

  void add(std::shared_ptr<Callback>) override { assert(!"a worker has no callbacks"); }
  void remove(const std::vector<std::shared_ptr<Callback>>&) override {}
  bool is_on_own_thread() const noexcept override { return false; }

 private:
  Function function_;
  FailureHandler on_failure_;
  std::stop_source stop_;
};

}  // namespace cie::executor
