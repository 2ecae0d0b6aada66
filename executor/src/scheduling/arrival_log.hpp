// When each sample of a queue arrived, and from whom.
#pragma once

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace cie::scheduling {

struct Arrival {
  std::int64_t time_ns = 0;  // CLOCK_MONOTONIC
  std::uint64_t writer_gid = 0;
};

// A ring of the latest arrivals, keyed by the address of the sample. One recorder at a time, any
// number of lock-free lookups. An address is recorded anew when its memory is used again, and
// lookups go from the newest entry back, so they find the right one. What fell out of the ring is
// not found: the arrival of that sample is unknown, never guessed.
class ArrivalLog {
 public:
  // Room for four times the queue, so that a sample in the queue is in the log even when others
  // were pushed out around it.
  explicit ArrivalLog(std::size_t queue_depth)
      : size_(std::bit_ceil(std::clamp<std::size_t>(queue_depth * 4, 64, 65536))),
        slots_(std::make_unique<Slot[]>(size_)) {}

  void record(const void* sample, const Arrival& arrival) noexcept {
    const std::uint64_t index = count_.load(std::memory_order_relaxed);
    Slot& slot = slots_[index & (size_ - 1)];
    slot.version.store(0, std::memory_order_release);
    slot.sample.store(sample, std::memory_order_release);
    slot.time_ns.store(arrival.time_ns, std::memory_order_release);
    slot.writer_gid.store(arrival.writer_gid, std::memory_order_release);
    slot.version.store(index + 1, std::memory_order_release);
    count_.store(index + 1, std::memory_order_release);
  }

  std::optional<Arrival> find(const void* sample) const noexcept {
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    const std::uint64_t oldest = count > size_ ? count - size_ : 0;
    for (std::uint64_t index = count; index-- > oldest;) {
      const Slot& slot = slots_[index & (size_ - 1)];
      if (slot.sample.load(std::memory_order_acquire) != sample) continue;
      const Arrival arrival{.time_ns = slot.time_ns.load(std::memory_order_acquire),
                            .writer_gid = slot.writer_gid.load(std::memory_order_acquire)};
      if (slot.version.load(std::memory_order_acquire) == index + 1) return arrival;
      return std::nullopt;  // overwritten by now, and everything older with it
    }
    return std::nullopt;
  }

 private:
  struct Slot {
    std::atomic<std::uint64_t> version{0};  // index + 1 when complete; indices never repeat
    std::atomic<const void*> sample{nullptr};
    std::atomic<std::int64_t> time_ns{0};
    std::atomic<std::uint64_t> writer_gid{0};
  };
  std::size_t size_;
  std::unique_ptr<Slot[]> slots_;
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace cie::scheduling
