// Callbacks served one after the other by one thread.
#pragma once

#include "loop.hpp"
#include "wakeup.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace cie::executor {

// The dispatch of a callback's own thread, of a group's, and of the single-threaded executor.
// Between wake-up and callback it takes no lock and allocates nothing: the set of callbacks is the
// thread's own copy, renewed when a counter says so.
class SerialLoop final : public Loop {
 public:
  explicit SerialLoop(FailureSink& failures) : failures_(failures) {}

  void on_ready(Callback& callback) noexcept override;
  void add(std::shared_ptr<Callback> callback) override;
  void remove(const std::vector<std::shared_ptr<Callback>>& callbacks) override;
  void run(std::int64_t deadline_ns) override;
  void stop() noexcept override;
  // Undoes stop(), while no thread runs the loop.
  void resume() noexcept { is_stopped_.store(false, std::memory_order_release); }
  bool is_on_own_thread() const noexcept override;

 private:
  using Callbacks = std::vector<std::shared_ptr<Callback>>;

  // Makes the thread's copy current.
  void adopt_changes();
  // Runs everything that is ready now, in order, one instance of each at a time. True if any ran.
  bool pass();
  std::int64_t next_due() const noexcept;
  bool has_changed() const noexcept;

  FailureSink& failures_;
  Wakeup wakeup_;
  std::atomic<bool> is_stopped_{false};

  std::mutex mutex_;  // of what follows
  std::condition_variable adopted_;
  Callbacks wanted_;
  std::atomic<std::uint64_t> wanted_version_{0};
  std::atomic<std::uint64_t> served_version_{0};
  std::atomic<std::thread::id> runner_{};

  Callbacks served_;  // of the thread that runs
};

}  // namespace cie::executor
