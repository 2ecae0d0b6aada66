// What the executors have in common: membership, start and end of spinning, cancellation.
// They differ in their placement of callbacks on threads.
#pragma once

#include <cie/scheduling/cancellation.hpp>
#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/placement.hpp>
#include <cie/scheduling/served_node.hpp>
#include <cie/scheduling/spawned_threads.hpp>
#include <cie/scheduling/thread_configurator.hpp>
#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace cie::scheduling {

class ExecutorCore final : public FailureHandler,
                           public std::enable_shared_from_this<ExecutorCore> {
 public:
  ExecutorCore(ExecutorKind kind, ExecutorOptions options, const PlacementFactory& placement);

  void add_node(const std::shared_ptr<ServedNode>& node);
  // Throws std::logic_error for a stranger, and in a callback that it would have to wait for, or that
  // one which it would have to wait for waits for.
  void remove_node(ServedNode& node);
  // Likewise for a node that goes: a stranger is ignored, and its callbacks' end() waits for them.
  void drop_node(ServedNode& node);
  void drop_all_nodes();
  // These are about to end: none of them will run any more. Waits for those that run, unless the
  // caller is a callback itself.
  void withdraw(const std::vector<std::shared_ptr<Callback>>& callbacks);
  // The same, without waiting for those that run: for a thread that nobody may keep. Their teams are
  // joined by whoever waits next, at the latest by spin().
  void abandon(const std::vector<std::shared_ptr<Callback>>& callbacks);
  // Callbacks that a node got, as far as it still has them: served at once while spinning, if the
  // node still belongs here.
  void serve_new(ServedNode& node, const std::vector<std::shared_ptr<Callback>>& callbacks);

  // The threads that serve the node beside those of callbacks, as far as they are new; while
  // spinning, and if the node belongs here. Throws SchedulingRefused.
  void configure_new_workers(const ServedNode& node);

  // What the calling thread does while the callbacks are served: by default it waits for cancel() and
  // for the deadline.
  using WhileServing = std::function<void(Cancellation& cancellation)>;
  void spin(std::int64_t deadline_ns, const WhileServing& while_serving = {});
  void cancel() noexcept;
  // Not in spin().
  void wait_until_idle() const noexcept;
  // Whether the calling thread is the one that spins and runs callbacks itself.
  bool is_on_own_thread() const noexcept;
  bool is_spinning() const noexcept { return is_spinning_.load(std::memory_order_acquire); }
  std::vector<SchedulingProblem> problems() const { return configurator_.problems(); }
  void reload_spec(std::shared_ptr<const SchedulingSpec> spec);

  void spawn_thread(const std::string& name, SpawnedThreads::Function function) {
    spawned_.start(name, std::move(function));
  }
  // Asks all threads of spawn_thread() to stop and joins them; final.
  void end_spawned_threads() { spawned_.end(); }

  void on_failure(CallbackFailure failure) noexcept override;

 private:
  using Callbacks = Placement::Callbacks;

  // One spin() from its beginning to its end, whichever way it ends.
  class Spin;

  // With mutex_ held.
  bool is_member(const ServedNode& node) const;
  Callbacks all_callbacks() const;
  // Puts callbacks on threads, and lets them run.
  void serve(const Callbacks& callbacks);
  // Without it.
  void take_off(const Callbacks& callbacks, bool may_wait);
  // Likewise. If it does not wait, it was counted as departing, and teams that leave are joined
  // later.
  void vacate(const Placement::Vacating& vacating, bool waits);
  enum class Departed : std::uint8_t { has_left, all };
  // All of them: after those that are departing.
  Placement::Teams take_departed(Departed which);
  void join_departed(Departed which);
  void configure_workers_of(const ServedNode& node);
  // Tells the trace how the spins so far ended.
  void count_spins(int more);
  KnownIds known_ids() const;

  const ExecutorOptions options_;
  trace::Run run_;
  ThreadConfigurator configurator_{options_};
  std::atomic<bool> is_spinning_{false};
  // Whoever cancels may be a signal handler in another thread, and is not done when spin() wakes up:
  // what it uses must outlive it, and its executor may go as soon as spin() has returned.
  void wait_for_cancelling() const noexcept;

  Cancellation cancellation_;
  std::atomic<int> cancelling_{0};  // calls of cancel() that have not returned

  mutable std::mutex mutex_;  // of what follows, but for running the placement and cancelling it
  const std::unique_ptr<Placement> placement_;
  bool is_serving_ = false;
  std::vector<std::shared_ptr<ServedNode>> nodes_;
  std::set<std::weak_ptr<trace::Thread>, std::owner_less<>> configured_workers_;
  Placement::Teams departed_;  // stopped by a callback, and so not joined yet
  int departing_ = 0;          // calls that are about to add to these
  std::condition_variable departing_ended_;

  std::mutex failure_mutex_;                // of what follows
  int unreturned_spins_ = 0;                // that spin, or threw
  std::optional<CallbackFailure> failure_;  // the first one

  SpawnedThreads spawned_{configurator_, *this};
};

}  // namespace cie::scheduling
