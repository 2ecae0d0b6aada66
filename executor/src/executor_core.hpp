// What the executors have in common: membership, start and end of spinning, cancellation.
// They differ in how callbacks are put on loops and threads.
#pragma once

#include <cie/executor/executor.hpp>
#include <cie/tracepoints/trace.hpp>

#include "loop.hpp"
#include "team.hpp"
#include "wakeup.hpp"
#include "worker_threads.hpp"

#include <atomic>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace cie::executor {

class ContextState;
class NodeState;

class ExecutorCore final : public FailureSink, public std::enable_shared_from_this<ExecutorCore> {
 public:
  ExecutorCore(ExecutorKind kind, ExecutorOptions options);

  void add_node(const std::shared_ptr<NodeState>& node);
  void remove_node(NodeState& node);
  void remove_all_nodes();
  // A callback that a node got: served at once while spinning, if the node still belongs here.
  void serve_new(NodeState& node, const std::shared_ptr<Callback>& callback);

  // The threads that serve the node beside those of callbacks, as far as they are new; while
  // spinning, and if the node belongs here. Throws ParametersRefused.
  void configure_new_workers(const NodeState& node);

  void spin(std::int64_t deadline_ns);
  void cancel() noexcept;
  bool is_spinning() const noexcept { return is_spinning_.load(std::memory_order_acquire); }
  std::vector<ParameterProblem> problems() const { return configurator_.problems(); }
  void reload_spec(std::shared_ptr<const SchedulingSpec> spec);

  void spawn_thread(const std::string& name, FunctionLoop::Function function);
  // Asks all threads of spawn_thread() to stop and joins them; final.
  void end_workers() { workers_.end(); }

  void on_failure(Callback& callback, std::exception_ptr exception) noexcept override;

 private:
  using Callbacks = std::vector<std::shared_ptr<Callback>>;
  using TeamPtr = std::shared_ptr<Team>;

  // One spin() from its beginning to its end, whichever way it ends.
  class Spin;

  // With mutex_ held: puts callbacks on threads, which it starts and configures first. Returns the
  // new teams, whose gates are still closed. Throws ParametersRefused, with nothing of it left.
  std::vector<TeamPtr> serve(const Callbacks& callbacks);
  std::vector<TeamPtr> serve_isolated(const Callbacks& callbacks);
  std::vector<TeamPtr> serve_pooled(const Callbacks& callbacks);
  static void open_gates(const std::vector<TeamPtr>& teams);
  static ThreadPlan plan_for_group(const Callbacks& callbacks_of_group);
  TeamPtr start_group_team(const GroupState& group, const ThreadPlan& plan);
  void configure_workers_of(const NodeState& node);
  void refuse_if_any(const std::vector<ParameterProblem>& problems) const;
  unsigned pool_size() const;
  std::unique_ptr<Loop> group_loop(GroupType type);
  void wait_for_end(std::int64_t deadline_ns);
  void wait_for_cancel(std::int64_t deadline_ns);
  void fail(CallbackFailure failure) noexcept;

  const ExecutorKind kind_;
  const ExecutorOptions options_;
  trace::Run run_;
  ThreadConfigurator configurator_{options_};
  std::atomic<bool> is_spinning_{false};
  std::atomic<bool> is_cancelled_{false};
  Wakeup wakeup_;  // of the thread that waits for cancel(), unless a loop does that itself
  const std::unique_ptr<Loop> own_loop_;  // of the executors on spin()'s own thread

  std::mutex mutex_;  // of what follows
  bool is_serving_ = false;
  std::vector<std::shared_ptr<NodeState>> nodes_;
  std::set<const Callback*> served_;
  std::map<const GroupState*, TeamPtr> teams_;  // isolated: by group; pooled: one, under null
  std::set<std::weak_ptr<trace::Thread>, std::owner_less<>> configured_workers_;

  std::mutex failure_mutex_;
  std::exception_ptr failure_;

  WorkerThreads workers_{configurator_,
                         [this](CallbackFailure failure) { fail(std::move(failure)); }};
};

}  // namespace cie::executor
