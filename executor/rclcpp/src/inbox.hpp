// What waits for a callback, as the middleware announced it: when each message arrived.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/trace.hpp>

#include "overwritten_count.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

namespace cie_rclcpp {

// One announcement: a message, a request, or that an entity of a waitable is ready.
struct Arrival {
  static constexpr int kAnyEntity = -1;  // one of a waitable's, and it is not known which

  std::int64_t monotonic_ns = -1;  // -1: it came before anybody listened, or is not known any more
  std::int64_t realtime_ns = 0;
  int entity = 0;            // which of a waitable's
  std::uint64_t number = 0;  // of this announcement, when it was taken
};

// The middleware keeps the messages, this the times of their arrival, in the same order and with the
// same bound: the latest `depth`. One announcer at a time (a mutex sees to it), any number of
// takers, who take no lock.
class ArrivalQueue {
 public:
  // `depth` 0: no bound is known.
  explicit ArrivalQueue(std::size_t depth);

  void add(const Arrival& arrival) noexcept;
  std::optional<Arrival> take() noexcept;
  // Whether the queue was full of what came since, so that the message of this one may be gone.
  bool may_be_overwritten(const Arrival& arrival) const noexcept;
  // Whether the latest that waits was announced at that time (CLOCK_REALTIME) or later.
  bool waits_since(std::int64_t realtime_ns) const noexcept;
  // Whether take() would find something, and when that arrived.
  std::optional<std::int64_t> oldest() const noexcept;
  std::uint64_t queued() const noexcept;
  // How many were overwritten so far. While others take, it may be late, but never too high.
  std::uint64_t overwritten() const noexcept;

 private:
  struct Slot {
    std::atomic<std::int64_t> monotonic_ns{-1};
    std::atomic<std::int64_t> realtime_ns{0};
    std::atomic<int> entity{0};
  };
  // The first that is not overwritten, of those from `next` to `stored`.
  std::uint64_t first_kept(std::uint64_t next, std::uint64_t stored) const noexcept {
    return depth_ > 0 && stored - next > depth_ ? stored - depth_ : next;
  }
  // As much as is still known of a claimed one.
  Arrival arrival_of(std::uint64_t number) const noexcept;

  std::size_t depth_;
  std::size_t size_;
  std::unique_ptr<Slot[]> slots_;
  std::atomic<std::uint64_t> stored_{0};
  std::atomic<std::uint64_t> next_{0};
  std::atomic<std::uint64_t> overwritten_{0};
};

// The arrivals of one callback, and who is told of them. Shared by the callback and by the notice
// that an entity holds, so that neither needs the other to live.
class Inbox {
 public:
  // Of a subscription: from the middleware, and from publishers of the same process; and what the
  // middleware lost before it could be queued.
  enum class Source : std::uint8_t { middleware, process, lost };

  // `is_shared`: the middleware's queue also holds what is for others.
  Inbox(std::size_t middleware_depth, std::size_t process_depth, bool is_shared = false);

  // The entity's notice: `count` came. On whichever thread delivers.
  void announce(Source source, std::size_t count, int entity) noexcept;
  // What is announced on the calling thread until the end of `register_at` came earlier.
  template <typename Register>
  void connect(Register register_at) {
    registering_.store(std::this_thread::get_id());
    try {
      register_at();
    } catch (...) {
      registering_.store(std::thread::id{});
      throw;
    }
    registering_.store(std::thread::id{});
  }

  // Null ends it; no call into `sink` is running when this returns.
  void set_target(cie::scheduling::ReadySink* sink, cie::scheduling::Callback* callback) noexcept;
  void set_trace(cie::trace::Callback* trace) noexcept;
  // Has the target look again.
  void wake() noexcept;

  struct Taken {
    Source source = Source::middleware;
    Arrival arrival{};
    bool is_announced = true;
  };
  // The oldest announcement. Before all others, where the middleware did not say how many messages came
  // earlier: one of these, until found_nothing() of it.
  std::optional<Taken> take() noexcept;
  void found_nothing(const Taken& taken) noexcept;
  // There was one, and who wrote it. One taker at a time.
  void found(const Taken& taken, std::uint64_t writer);
  bool may_be_overwritten(const Taken& taken) noexcept;
  // Whether an announcement waits that may be that of a message sent at `realtime_ns`.
  bool may_wait_for(const Taken& taken, std::int64_t realtime_ns) noexcept {
    return queue(taken.source).waits_since(realtime_ns);
  }
  // Whether something was lost since the last time.
  bool take_lost() noexcept {
    return has_lost_.load(std::memory_order_relaxed) && has_lost_.exchange(false);
  }
  std::uint64_t queued() const noexcept;
  // With those that nobody counted as one; and since when the first waits, kNever: none does.
  std::uint64_t waiting() const noexcept { return queued() + (has_earlier_.load() ? 1 : 0); }
  std::int64_t ready_at() const noexcept;
  std::uint64_t overwritten() const noexcept;

 private:
  ArrivalQueue& queue(Source source) noexcept {
    return source == Source::middleware ? middleware_ : *process_;
  }

  ArrivalQueue middleware_;
  std::optional<ArrivalQueue> process_;
  OverwrittenCount overwritten_;  // in the middleware's
  std::atomic<std::thread::id> registering_{};
  std::atomic<bool> has_lost_{false};
  std::atomic<bool> has_earlier_{false};  // messages that nobody counted
  cie::PriorityMutex mutex_;              // of what follows, and of announcing
  cie::scheduling::ReadySink* sink_ = nullptr;
  cie::scheduling::Callback* callback_ = nullptr;
  cie::trace::Callback* trace_ = nullptr;
};

}  // namespace cie_rclcpp
