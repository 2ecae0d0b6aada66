// OS threads that do one thing together.
#pragma once

#include <cie/scheduling/problem.hpp>
#include <cie/scheduling/thread_configurator.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace cie::scheduling {

// What each thread of a team is announced as, and whose entry of the spec configures it: that of
// the first of `callbacks` (logical ids) that has one, or, without callbacks, that of the name.
struct ThreadPlan {
  ThreadRole role = ThreadRole::pool;
  CallbackId callback = kNoCallback;
  GroupId group = kNoGroup;
  std::string name{};
  std::vector<SpecCallback> callbacks{};
};

// What the threads of a team do.
struct TeamBody {
  std::function<void()> run;   // on each of them; must not throw
  std::function<void()> stop;  // has every run() return soon; on any thread, more than once
};

// A thread names itself, announces itself, applies its parameters, reads them back and emits them;
// then it waits at a gate. Only behind the gate does it run the body, so nothing runs unconfigured.
// Functions may be called from any thread.
class Team {
 public:
  // Starts the threads. Throws std::system_error if the system refuses one; then none is left.
  Team(TeamBody body, const std::vector<ThreadPlan>& plans, ThreadConfigurator& configurator);
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;
  ~Team();

  // Waits until every thread stands at the gate. Returns what went wrong with their parameters.
  std::vector<SchedulingProblem> wait_configured();
  void open_gate();
  // Whether all its threads have left: join() does not wait then.
  bool has_left() const noexcept { return present_.load(std::memory_order_acquire) == 0; }
  // Makes the threads leave; does not wait for them.
  void stop();
  // After stop(), not from a thread of this team.
  void join();

 private:
  enum class Gate : std::uint8_t { closed, open, leave };

  void run(const ThreadPlan& plan) noexcept;
  void set_gate(Gate gate);

  const TeamBody body_;
  ThreadConfigurator& configurator_;
  std::atomic<std::size_t> present_;  // threads that have not left
  std::mutex mutex_;                  // of what follows
  std::condition_variable changed_;
  Gate gate_ = Gate::closed;
  std::size_t unconfigured_;
  std::vector<SchedulingProblem> problems_;
  std::exception_ptr failure_;
  std::mutex join_mutex_;  // of the threads
  std::vector<std::thread> threads_;
};

}  // namespace cie::scheduling
