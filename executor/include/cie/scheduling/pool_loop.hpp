// Callbacks served by several threads from one queue.
#pragma once

#include <cie/scheduling/event_count.hpp>
#include <cie/scheduling/loop.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace cie::scheduling {

// The dispatch of the multi-threaded executor and of a reentrant group's pool. One idle thread, the
// leader, waits for the next timer; the others wait for work. Callbacks of a mutually exclusive
// group never overlap; one of a reentrant group runs on as many threads at once as there are messages
// for it. The lock is that of the pool's threads alone: whoever makes a callback ready marks it and
// wakes a thread, and waits for none.
class PoolLoop final : public Loop, public ReadySink {
 public:
  explicit PoolLoop(const LoopParts& parts) : parts_(parts) {}

  void on_ready(Callback& callback) noexcept override;
  void add(std::shared_ptr<Callback> callback) override;
  void remove(const std::vector<std::shared_ptr<Callback>>& callbacks) override;
  void abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) override;
  void run(std::int64_t deadline_ns) override;
  void stop() noexcept override;
  void wake() noexcept override;
  bool is_on_own_thread() const noexcept override;

 private:
  struct Served {
    std::shared_ptr<Callback> callback;
    std::shared_ptr<int> running_of_group;
    int running = 0;
    bool is_removed = false;
    bool is_abandoned = false;  // nobody waits: whoever runs it last lets go of it
  };
  using ServedPtr = std::unique_ptr<Served>;

  bool is_over() const noexcept { return is_stopped_.load() || parts_.cancellation.is_cancelled(); }
  // All with the lock held.
  static bool may_overlap(const Served& served) noexcept;
  Served* pick();
  static bool is_blocked(const Served& served) noexcept;
  // Returns what is to be let go of without the lock.
  [[nodiscard]] ServedPtr finish(Served& served, bool has_run);
  [[nodiscard]] std::vector<ServedPtr> take_idle_removed();
  std::int64_t next_due() const;
  void wait(std::unique_lock<PriorityMutex>& lock, EventCount::Ticket ticket,
            std::int64_t deadline_ns);

  const LoopParts parts_;
  EventCount work_;
  EventCount finished_;
  std::atomic<bool> is_stopped_{false};
  mutable PriorityMutex mutex_;  // of everything below
  std::vector<ServedPtr> served_;
  std::vector<std::thread::id> runners_;
  std::size_t turn_ = 0;  // where pick() begins: every callback gets its turn
  int idle_ = 0;
  bool has_leader_ = false;
  std::int64_t leader_until_ns_ = 0;
};

}  // namespace cie::scheduling
