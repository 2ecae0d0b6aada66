// Callbacks served as rclcpp serves them: a baseline to compare with, not to use.
#pragma once

#include <cie/scheduling/loop.hpp>

#include "dds/dds_entity.hpp"
#include "scheduling_names.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace cie::executor {

// The dispatch of rclcpp's executors over rmw_cyclonedds (Humble), with its costs: one DDS wait set
// for all callbacks, collected anew for every wait under a lock, and attached anew whenever another
// set of callbacks may run; a guard condition that interrupts the wait after every instance and at
// every change; with several threads, one that waits while the others wait for their turn to.
// Messages are noticed by read conditions, triggers by a guard condition each. As there, what a
// wait found is run, an instance each, before the next wait. Timeouts follow the settable clock.
class WaitSetLoop final : public Loop {
 public:
  // Throws dds::Error.
  explicit WaitSetLoop(const LoopParts& parts);
  ~WaitSetLoop() override;

  void add(std::shared_ptr<Callback> callback) override;
  void remove(const std::vector<std::shared_ptr<Callback>>& callbacks) override;
  void abandon(const std::vector<std::shared_ptr<Callback>>& callbacks) override;
  void run(std::int64_t deadline_ns) override;
  void stop() noexcept override;  // takes locks of DDS
  void wake() noexcept override { interrupt(); }
  bool is_on_own_thread() const noexcept override;

 private:
  // A callback in service, with what the wait set waits for on its behalf.
  struct Slot;
  using SlotPtr = std::unique_ptr<Slot>;

  // The next callback to run, marked as running; null if there is none after one wait.
  Slot* next(std::int64_t deadline_ns);
  void wait_for_work(std::int64_t deadline_ns);
  // With mutex_ held.
  Slot* take_ready();
  bool is_blocked(const Slot& slot) const;
  std::int64_t collect();
  void attach(const std::vector<Slot*>& slots);
  void note(dds_attach_t triggered);

  // Takes them out of the wait set, so that none is run any more.
  void mark_removed(const std::vector<std::shared_ptr<Callback>>& callbacks, bool is_abandoned);
  // With mutex_ held: what DDS is to delete without the lock.
  [[nodiscard]] std::vector<SlotPtr> take_idle_removed();
  void finish(Slot& slot, bool has_run);
  void interrupt() noexcept;
  bool is_over(std::int64_t deadline_ns) const noexcept;

  const LoopParts parts_;
  dds::Entity interrupt_;
  dds::Entity wait_set_;
  std::atomic<bool> is_stopped_{false};
  std::mutex turn_;                    // of the thread that collects and waits, or changes the set
  std::vector<Slot*> collected_;       // with turn_ held
  std::vector<Slot*> attached_;        // with turn_ held
  std::vector<dds_attach_t> results_;  // with turn_ held; room for all that is attached

  mutable std::mutex mutex_;  // of what follows; taken after turn_
  std::condition_variable changed_;
  std::vector<SlotPtr> slots_;  // timers first, then as rclcpp asks: by kind
  std::map<const GroupState*, int> running_of_group_;
  std::vector<std::thread::id> runners_;
  int changing_ = 0;  // calls of remove() that want their turn
};

}  // namespace cie::executor
