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

// A ring of the latest arrivals, found by the address of the sample: addresses of one hash are a
// chain through the ring, from the newest entry back, so that a lookup costs the same however many
// samples wait. One recorder at a time, any number of lock-free lookups. An address is recorded anew
// when its memory is used again, and its newest entry comes first in the chain. What fell out of the
// ring is not found: the arrival of that sample is unknown, never guessed.
class ArrivalLog {
 public:
  // Room for four times the queue, so that a sample in the queue is in the log even when others
  // were pushed out around it.
  explicit ArrivalLog(std::size_t queue_depth)
      : size_(std::bit_ceil(std::clamp<std::size_t>(queue_depth * 4, 64, 65536))),
        slots_(std::make_unique<Slot[]>(size_)),
        newest_(std::make_unique<std::atomic<std::uint64_t>[]>(size_)) {}

  void record(const void* sample, const Arrival& arrival) noexcept {
    const std::uint64_t number = ++recorded_;
    Slot& slot = slots_[number & (size_ - 1)];
    std::atomic<std::uint64_t>& newest = newest_of(sample);
    slot.number.store(0, std::memory_order_release);
    slot.sample.store(sample, std::memory_order_release);
    slot.time_ns.store(arrival.time_ns, std::memory_order_release);
    slot.writer_gid.store(arrival.writer_gid, std::memory_order_release);
    slot.older.store(newest.load(std::memory_order_relaxed), std::memory_order_release);
    slot.number.store(number, std::memory_order_release);
    newest.store(number, std::memory_order_release);
  }

  std::optional<Arrival> find(const void* sample) const noexcept {
    std::uint64_t number = newest_of(sample).load(std::memory_order_acquire);
    while (number != 0) {
      const Slot& slot = slots_[number & (size_ - 1)];
      const void* const of = slot.sample.load(std::memory_order_acquire);
      const Arrival arrival{.time_ns = slot.time_ns.load(std::memory_order_acquire),
                            .writer_gid = slot.writer_gid.load(std::memory_order_acquire)};
      const std::uint64_t older = slot.older.load(std::memory_order_acquire);
      // Overwritten by now, and everything older with it.
      if (slot.number.load(std::memory_order_acquire) != number) return std::nullopt;
      if (of == sample) return arrival;
      number = older;
    }
    return std::nullopt;
  }

 private:
  // Entries are numbered from 1; numbers never repeat.
  struct Slot {
    std::atomic<std::uint64_t> number{0};  // 0 while it is written
    std::atomic<const void*> sample{nullptr};
    std::atomic<std::int64_t> time_ns{0};
    std::atomic<std::uint64_t> writer_gid{0};
    std::atomic<std::uint64_t> older{0};  // in its chain; 0: none
  };
  // Where the chain of this address begins. The high bits of the product depend on all of its bits.
  std::atomic<std::uint64_t>& newest_of(const void* sample) const noexcept {
    const std::uint64_t product =
        reinterpret_cast<std::uintptr_t>(sample) * std::uint64_t{0x9e3779b97f4a7c15};
    return newest_[product >> static_cast<unsigned>(64 - std::countr_zero(size_))];
  }

  std::size_t size_;
  std::unique_ptr<Slot[]> slots_;
  std::unique_ptr<std::atomic<std::uint64_t>[]> newest_;
  std::uint64_t recorded_ = 0;
};

}  // namespace cie::scheduling
