// The OS threads that run one loop.
#pragma once

#include <cie/executor/executor.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include "exclusive_cpusets.hpp"
#include "kernel_view.hpp"
#include "loop.hpp"

#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cie::executor {

// Gives a thread its parameters and tells how that went. Thread-safe.
class ThreadConfigurator {
 public:
  explicit ThreadConfigurator(const ExecutorOptions& options) : options_(options) {}

  // Asks the kernel for what `entry` wants (null: nothing), emits the `applied` read-back, compares
  // it, and passes the problems to the handler. Any thread of this process may be configured.
  std::vector<ParameterProblem> configure(trace::Thread& thread, const std::string& name,
                                          const SpecEntry* entry);
  // The spec's entry for a callback's thread, or for another thread by its name; null if none.
  const SpecEntry* entry_of_callback(const std::string& logical_id) const noexcept;
  const SpecEntry* entry_of_thread(const std::string& name) const noexcept;
  // Tells the handler and remembers.
  void report(const ParameterProblem& problem);
  std::vector<ParameterProblem> problems() const;
  // Why the system gave no thread, in words.
  std::string why_no_thread(int error) const;
  ParameterProblem problem(const SpecEntry& entry, const std::string& thread, int error,
                           std::string reason) const;

 private:
  const ExecutorOptions& options_;
  KernelView kernel_;
  ExclusiveCpusets cpusets_{kernel_};
  mutable std::mutex mutex_;
  std::vector<ParameterProblem> problems_;
};

// What each thread of a team is announced as, and the entry that configures it.
struct ThreadPlan {
  ThreadRole role = ThreadRole::pool;
  CallbackId callback = kNoCallback;
  GroupId group = kNoGroup;
  std::string name;
  const SpecEntry* entry = nullptr;
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
