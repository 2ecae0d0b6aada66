// How many samples of a queue were pushed out before anybody took them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>

namespace cie::scheduling {

// What a take brought: `other` is a notice without data (an instance or a writer ended).
enum class TakeOutcome : std::uint8_t { sample, other, empty };

// overwritten = stored - taken - still queued. What is queued is not observable from outside, but
// bounded: at most `depth`, and nothing when a take came back empty. Both bounds are exact when it
// matters (a full queue, an empty one) and never too high in between: the count errs late, not
// wrong.
class QueueCount {
 public:
  // `depth` 0: the queue never overwrites, or its bound is not known (keyed topics); then only the
  // empty queue tells.
  explicit QueueCount(std::uint32_t depth) noexcept : depth_(depth) {}

  // One recorder at a time, after the sample is in the queue. Returns the count of overwritten.
  std::uint64_t on_stored() noexcept {
    const std::uint64_t stored = stored_.load(std::memory_order_relaxed) + 1;
    stored_.store(stored, std::memory_order_release);
    if (depth_ > 0) {
      const std::uint64_t accounted = claimed_.load(std::memory_order_acquire) + depth_;
      if (stored > accounted) raise_to(stored - accounted);
    }
    return overwritten();
  }

  // Around a take: claims before, so that on_stored() never counts a sample that is being taken.
  // Returns what end_take() wants.
  std::uint64_t begin_take() noexcept {
    const std::uint64_t stored = stored_.load(std::memory_order_acquire);
    claimed_.fetch_add(1, std::memory_order_acq_rel);
    return stored;
  }
  void end_take(TakeOutcome outcome, std::uint64_t stored_before) noexcept {
    if (outcome == TakeOutcome::sample) return;
    const std::uint64_t claimed = claimed_.fetch_sub(1, std::memory_order_acq_rel) - 1;
    // Empty: everything stored before begin_take() was taken or overwritten. With several takers at
    // once the claims of the others make the count late.
    if (outcome == TakeOutcome::empty && stored_before > claimed) raise_to(stored_before - claimed);
  }

  // How many wait to be taken; for the moment too many or too few while others store and take.
  std::uint64_t queued() const noexcept {
    const std::uint64_t gone = claimed_.load(std::memory_order_relaxed) + overwritten();
    const std::uint64_t stored = stored_.load(std::memory_order_relaxed);
    return stored > gone ? stored - gone : 0;
  }

  std::uint64_t overwritten() const noexcept {
    return overwritten_.load(std::memory_order_relaxed);
  }

 private:
  void raise_to(std::uint64_t value) noexcept {
    std::uint64_t current = overwritten();
    while (current < value &&
           !overwritten_.compare_exchange_weak(current, value, std::memory_order_relaxed)) {
    }
  }

  std::uint32_t depth_;
  std::atomic<std::uint64_t> stored_{0};
  std::atomic<std::uint64_t> claimed_{0};
  std::atomic<std::uint64_t> overwritten_{0};
};

}  // namespace cie::scheduling
