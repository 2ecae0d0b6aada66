// Callbacks served one after the other, in the order in which they became ready.
#pragma once

#include <cie/scheduling/one_thread_loop.hpp>

#include <atomic>
#include <cstdint>
#include <vector>

namespace cie::scheduling {

// The dispatch of the events executor: a queue of ready callbacks. What it costs to find the next
// one does not depend on how many there are, but for the timers, which are looked at one by one. A
// callback stands in the queue at most once, and goes to its end after each instance, so that a
// full queue of messages holds up nobody else. The queue is a list through the callbacks: it
// allocates nothing and has no bound to run into.
class EventsLoop final : public OneThreadLoop {
 public:
  using OneThreadLoop::OneThreadLoop;
  void on_ready(Callback& callback) noexcept override;

 private:
  bool pass() override;
  std::int64_t next_due() const noexcept override;
  void adopt() override;
  void forget(const Callbacks& gone) override;

  void collect() noexcept;
  void collect_due() noexcept;
  void append(Callback& callback) noexcept;
  Callback* pop() noexcept;

  std::atomic<Callback*> arrived_{nullptr};  // latest first; any thread pushes
  // Of the thread that runs, oldest first.
  Callback* first_ = nullptr;
  Callback* last_ = nullptr;
  std::vector<Callback*> timed_;
};

}  // namespace cie::scheduling
