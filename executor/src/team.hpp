// The OS threads that run one loop.
#pragma once

#include <cie/executor/executor.hpp>
#include <cie/tracepoints/trace.hpp>

#include "loop.hpp"
#include "thread_configurator.hpp"

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cie::executor {

// What each thread of a team is announced as, and whose entry of the spec configures it: that of
// the first of `callbacks` (logical ids) that has one, or, without callbacks, that of the name.
struct ThreadPlan {
  ThreadRole role = ThreadRole::pool;
  CallbackId callback = kNoCallback;
  GroupId group = kNoGroup;
  std::string name{};
  std::vector<std::string> callbacks{};
};

// A thread names itself, announces itself, applies its parameters, reads them back and emits them;
// then it waits at a gate. Only behind the gate does it serve callbacks, so none runs unconfigured.
// Functions may be called from any thread.
class Team {
 public:
  // Starts the threads. Throws std::system_error if the system refuses one; then none is left.
  Team(std::unique_ptr<Loop> loop, const std::vector<ThreadPlan>& plans,
       ThreadConfigurator& configurator);
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;
  ~Team();

  // Waits until every thread stands at the gate. Returns what went wrong with their parameters.
  std::vector<ParameterProblem> wait_configured();
  void open_gate();
  // Adds a callback; its loop serves it once the gate is open.
  void add(const std::shared_ptr<Callback>& callback);
  // Returns when none of them runs or will run; not from a thread of this team.
  void remove(const std::vector<std::shared_ptr<Callback>>& callbacks);
  Loop& loop() noexcept { return *loop_; }
  // Takes the callbacks out of service and makes the threads leave; does not wait for them.
  void stop();
  // After stop(), not from a thread of this team.
  void join();

 private:
  enum class Gate : std::uint8_t { closed, open, leave };

  void run(const ThreadPlan& plan) noexcept;
  void set_gate(Gate gate);

  std::unique_ptr<Loop> loop_;
  ThreadConfigurator& configurator_;
  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  Gate gate_ = Gate::closed;
  std::size_t unconfigured_;
  std::vector<ParameterProblem> problems_;
  std::exception_ptr failure_;
  std::vector<std::shared_ptr<Callback>> callbacks_;
  std::mutex join_mutex_;  // of the threads
  std::vector<std::thread> threads_;
};

}  // namespace cie::executor
