// What the loops have in common whose callbacks are served by one thread.
#pragma once

#include <cie/scheduling/event_count.hpp>
#include <cie/scheduling/loop.hpp>
#include <cie/scheduling/wakeup.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

namespace cie::scheduling {

// Between wake-up and callback it takes no lock and allocates nothing: the set of callbacks is the
// thread's own copy, renewed when a counter says so. How the next callback is found is the derived
// loop's.
class OneThreadLoop : public Loop, public ReadySink {
 public:
  explicit OneThreadLoop(const LoopParts& parts) : parts_(parts) {}

  void add(std::shared_ptr<Callback> callback) final;
  void remove(const std::vector<std::shared_ptr<Callback>>& callbacks) final;
  void abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) final;
  void run(std::int64_t deadline_ns) final;
  void stop() noexcept final;
  void wake() noexcept final { wakeup_.notify(); }
  bool is_on_own_thread() const noexcept final;

 protected:
  using Callbacks = std::vector<std::shared_ptr<Callback>>;

  // Runs what is ready, at most one instance of each callback. False if nothing was.
  virtual bool pass() = 0;
  virtual std::int64_t next_due() const noexcept = 0;
  // served() is another set now.
  virtual void adopt() {}
  // These are not served any more, and about to go: no trace of them may stay. Called before
  // adopt(), or while no thread runs the loop.
  virtual void forget(const Callbacks&) {}

  const Callbacks& served() const noexcept { return served_; }
  bool run_instance(Callback& callback) noexcept { return execute(callback, parts_); }
  // A pass should end, because the loop is to stop or to change.
  bool is_interrupted() const noexcept { return is_over() || has_changed(); }

 private:
  bool is_over() const noexcept {
    return is_stopped_.load(std::memory_order_acquire) || parts_.cancellation.is_cancelled();
  }
  // Makes the thread's copy current.
  void adopt_changes();
  // With mutex_ held. take_out() returns the version without them; forget_gone() what nothing
  // refers to any more, to be let go of without the lock.
  std::uint64_t take_out(const Callbacks& callbacks);
  [[nodiscard]] Callbacks forget_gone();
  bool has_changed() const noexcept;

  const LoopParts parts_;
  Wakeup wakeup_;
  std::atomic<bool> is_stopped_{false};

  PriorityMutex mutex_;  // of what follows
  EventCount adopted_;
  Callbacks wanted_;
  Callbacks gone_;  // removed, not yet forgotten
  std::atomic<std::uint64_t> wanted_version_{0};
  std::atomic<std::uint64_t> served_version_{0};
  std::atomic<std::thread::id> runner_{};

  Callbacks served_;  // of the thread that runs
};

}  // namespace cie::scheduling
