// Callbacks that are served by a loop on threads of its own.
#pragma once

#include <cie/scheduling/loop.hpp>
#include <cie/scheduling/team.hpp>
#include <cie/scheduling/threads.hpp>

#include <memory>
#include <mutex>
#include <vector>

namespace cie::scheduling {

// Functions may be called from any thread.
class LoopTeam {
 public:
  using Callbacks = std::vector<std::shared_ptr<Callback>>;

  // As Team's.
  LoopTeam(std::unique_ptr<Loop> loop, const std::vector<ThreadPlan>& plans,
           ThreadConfigurator& configurator);
  LoopTeam(const LoopTeam&) = delete;
  LoopTeam& operator=(const LoopTeam&) = delete;
  ~LoopTeam() { stop(); }

  std::vector<SchedulingProblem> wait_configured() { return team_.wait_configured(); }
  void open_gate() { team_.open_gate(); }
  // Adds a callback; the loop serves it once the gate is open.
  void add(const std::shared_ptr<Callback>& callback);
  // Returns when none of them runs or will run; not from a thread of this team.
  void remove(const Callbacks& callbacks);
  // None of them will run any more; one that runs, runs on. Any thread.
  void abandon(const Callbacks& callbacks);
  bool is_on_own_thread() const noexcept { return loop_->is_on_own_thread(); }
  // Takes the callbacks out of service and makes the threads leave; does not wait for them.
  void stop();
  // Whether all its threads have left: join() does not wait then.
  bool has_left() const noexcept { return team_.has_left(); }
  // After stop(), not from a thread of this team.
  void join() { team_.join(); }

 private:
  void take_out(const Callbacks& callbacks);

  const ThreadsId id_ = new_threads_id();
  std::unique_ptr<Loop> loop_;
  std::mutex mutex_;  // of what follows
  Callbacks callbacks_;
  Team team_;  // last: its threads use the loop
};

}  // namespace cie::scheduling
