#include "inbox.hpp"

#include <cie/scheduling/clock.hpp>

#include <algorithm>
#include <bit>
#include <chrono>
#include <mutex>

namespace cie_rclcpp {

// Room for four times the queue: what is taken has not been written over meanwhile.
ArrivalQueue::ArrivalQueue(std::size_t depth)
    : depth_(depth),
      size_(std::bit_ceil(std::clamp<std::size_t>(depth == 0 ? 1024 : depth * 4, 64, 65536))),
      slots_(std::make_unique<Slot[]>(size_)) {}

void ArrivalQueue::add(const Arrival& arrival) noexcept {
  const std::uint64_t stored = stored_.load(std::memory_order_relaxed);
  Slot& slot = slots_[stored & (size_ - 1)];
  slot.monotonic_ns.store(arrival.monotonic_ns, std::memory_order_release);
  slot.realtime_ns.store(arrival.realtime_ns, std::memory_order_release);
  slot.entity.store(arrival.entity, std::memory_order_release);
  stored_.store(stored + 1, std::memory_order_release);
}

// What was claimed may have been overwritten before, by what came since the look at stored_: then
// whoever looked before the claim has counted it. All orders of next_ and stored_ here and in
// overwritten() are sequential, so that the second look sees what such a one saw. arrival_queue.pml
std::optional<Arrival> ArrivalQueue::take() noexcept {
  std::uint64_t next = next_.load(std::memory_order_relaxed);
  while (true) {
    const std::uint64_t stored = stored_.load();
    if (next >= stored) return std::nullopt;
    const std::uint64_t first = first_kept(next, stored);
    if (!next_.compare_exchange_weak(next, first + 1)) continue;
    const bool is_overwritten = first_kept(first, stored_.load()) != first;
    const std::uint64_t passed = first - next + (is_overwritten ? 1 : 0);
    if (passed > 0) overwritten_.fetch_add(passed, std::memory_order_release);
    if (!is_overwritten) return arrival_of(first);
    next = first + 1;
  }
}

Arrival ArrivalQueue::arrival_of(std::uint64_t number) const noexcept {
  const Slot& slot = slots_[number & (size_ - 1)];
  Arrival arrival{.monotonic_ns = slot.monotonic_ns.load(std::memory_order_acquire),
                  .realtime_ns = slot.realtime_ns.load(std::memory_order_acquire),
                  .entity = slot.entity.load(std::memory_order_acquire),
                  .number = number};
  if (stored_.load(std::memory_order_acquire) >= number + size_) {
    arrival.monotonic_ns = -1;  // written over
    arrival.realtime_ns = 0;
    arrival.entity = Arrival::kAnyEntity;
  }
  return arrival;
}

// What comes next is stored before it is announced, and so counts.
bool ArrivalQueue::may_be_overwritten(const Arrival& arrival) const noexcept {
  return depth_ > 0 && stored_.load(std::memory_order_acquire) - arrival.number >= depth_;
}

bool ArrivalQueue::waits_since(std::int64_t realtime_ns) const noexcept {
  const std::uint64_t stored = stored_.load(std::memory_order_acquire);
  if (next_.load(std::memory_order_acquire) >= stored) return false;
  return slots_[(stored - 1) & (size_ - 1)].realtime_ns.load(std::memory_order_acquire) >=
         realtime_ns;
}

std::optional<std::int64_t> ArrivalQueue::oldest() const noexcept {
  const std::uint64_t stored = stored_.load(std::memory_order_acquire);
  const std::uint64_t next = next_.load(std::memory_order_acquire);
  if (next >= stored) return std::nullopt;
  return slots_[first_kept(next, stored) & (size_ - 1)].monotonic_ns.load(
      std::memory_order_acquire);
}

std::uint64_t ArrivalQueue::queued() const noexcept {
  const std::uint64_t stored = stored_.load(std::memory_order_acquire);
  const std::uint64_t next = next_.load(std::memory_order_acquire);
  return next < stored ? stored - first_kept(next, stored) : 0;
}

// In this order: whoever takes advances next_ first, and what comes while it does is not set against
// where it was. So the sum is never too high.
std::uint64_t ArrivalQueue::overwritten() const noexcept {
  std::uint64_t passed = 0;
  std::uint64_t next = 0;
  std::uint64_t stored = 0;
  do {
    passed = overwritten_.load(std::memory_order_acquire);
    next = next_.load();
    stored = stored_.load();
  } while (next_.load() != next);
  return next < stored ? passed + (first_kept(next, stored) - next) : passed;
}

Inbox::Inbox(std::size_t middleware_depth, std::size_t process_depth, bool is_shared)
    : middleware_(middleware_depth), overwritten_(middleware_depth, is_shared) {
  if (process_depth > 0) process_.emplace(process_depth);
}

void Inbox::announce(Source source, std::size_t count, int entity) noexcept {
  const bool is_earlier = registering_.load() == std::this_thread::get_id();
  Arrival arrival{.entity = entity};
  if (!is_earlier) {
    arrival.monotonic_ns = cie::scheduling::monotonic_now();
    arrival.realtime_ns =
        std::chrono::nanoseconds{std::chrono::system_clock::now().time_since_epoch()}.count();
  }
  // rmw_cyclonedds tells of what came earlier up to the depth, which for a queue that keeps all is 0.
  if (is_earlier && count == 0 && source == Source::middleware) has_earlier_.store(true);
  const std::lock_guard lock{mutex_};
  if (source == Source::lost) {
    has_lost_.store(true);
    count = 0;
  }
  for (; count > 0; --count) {
    queue(source).add(arrival);
    if (trace_ != nullptr) trace_->release(overwritten());
  }
  if (sink_ != nullptr) sink_->on_ready(*callback_);
}

void Inbox::set_target(cie::scheduling::ReadySink* sink,
                       cie::scheduling::Callback* callback) noexcept {
  const std::lock_guard lock{mutex_};
  sink_ = sink;
  callback_ = callback;
}

void Inbox::set_trace(cie::trace::Callback* trace) noexcept {
  const std::lock_guard lock{mutex_};
  trace_ = trace;
}

void Inbox::wake() noexcept {
  const std::lock_guard lock{mutex_};
  if (sink_ != nullptr) sink_->on_ready(*callback_);
}

std::optional<Inbox::Taken> Inbox::take() noexcept {
  if (has_earlier_.load()) return Taken{.is_announced = false};
  Source source = Source::middleware;
  if (process_) {
    const auto theirs = middleware_.oldest();
    const auto ours = process_->oldest();
    if (ours && (!theirs || *ours < *theirs)) source = Source::process;
  }
  const auto arrival = queue(source).take();
  if (!arrival) return std::nullopt;
  return Taken{.source = source, .arrival = *arrival};
}

void Inbox::found_nothing(const Taken& taken) noexcept {
  if (!taken.is_announced) has_earlier_.store(false);
  if (taken.source != Source::middleware) return;
  overwritten_.on_empty();
  overwritten_.on_other();
}

void Inbox::found(const Taken& taken, std::uint64_t writer) {
  if (taken.source == Source::middleware) overwritten_.on_taken(writer, middleware_.overwritten());
}

bool Inbox::may_be_overwritten(const Taken& taken) noexcept {
  return taken.is_announced && queue(taken.source).may_be_overwritten(taken.arrival);
}

std::uint64_t Inbox::queued() const noexcept {
  return middleware_.queued() + (process_ ? process_->queued() : 0);
}

std::int64_t Inbox::ready_at() const noexcept {
  if (has_earlier_.load()) return 0;
  const auto first = [](const std::optional<std::int64_t>& arrival) {
    return arrival.value_or(cie::scheduling::kNever);
  };
  return std::min(first(middleware_.oldest()), first(process_ ? process_->oldest() : std::nullopt));
}

std::uint64_t Inbox::overwritten() const noexcept {
  return overwritten_.count(middleware_.overwritten()) + (process_ ? process_->overwritten() : 0);
}

}  // namespace cie_rclcpp
