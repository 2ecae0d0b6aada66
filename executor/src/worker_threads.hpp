// The threads that a user asked for beside those of callbacks.
#pragma once

#include <cie/executor/executor.hpp>

#include "function_loop.hpp"
#include "team.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace cie::executor {

// Thread-safe. end() comes before destruction.
class WorkerThreads {
 public:
  using FailureHandler = std::function<void(CallbackFailure)>;
  // Both outlive the threads; `on_failure` must not throw.
  WorkerThreads(ThreadConfigurator& configurator, FailureHandler on_failure)
      : configurator_(configurator), on_failure_(std::move(on_failure)) {}

  // Starts a thread and configures it; `accept` throws if what went wrong is too much, and then the
  // function never runs.
  void start(const std::string& name, FunctionLoop::Function function,
             const std::function<void(const std::vector<ParameterProblem>&)>& accept);
  // Asks all to stop and joins them; final.
  void end();

 private:
  ThreadConfigurator& configurator_;
  FailureHandler on_failure_;
  std::mutex mutex_;  // of what follows
  bool has_ended_ = false;
  std::vector<std::shared_ptr<Team>> threads_;
};

}  // namespace cie::executor
