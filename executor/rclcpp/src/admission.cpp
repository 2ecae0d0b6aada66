#include "admission.hpp"

#include <mutex>
#include <utility>

namespace cie_rclcpp {
namespace {

thread_local std::uint64_t looking_of_thread = 0;

// An entry that an exception left; its handler ends it before the thread enters again.
struct Postponed {
  Admission::Share* share = nullptr;
  bool has_begun = false;
};
thread_local Postponed postponed;

}  // namespace

void Admission::open(const std::function<bool()>& is_cancelled) {
  const std::lock_guard lock{mutex_};
  if (is_cancelled()) return;
  ++round_;  // shares are over
  mode_.store(Mode::open);
}

// Either a thread that looks sees that it is closed, or this sees that it looks, and waits for it to begin.
// That is no user's code, but for a waitable's own: what looks on the calling thread is not waited for.
void Admission::close() noexcept {
  {
    const std::lock_guard lock{mutex_};
    mode_.store(Mode::closed);
  }
  wakeup_.notify();
  for (auto busy = busy_.load(); busy % kRunning > looking_of_thread; busy = busy_.load())
    busy_.wait(busy);
}

void Admission::wait_until_idle() const noexcept {
  for (auto busy = busy_.load(); busy != 0; busy = busy_.load())
    busy_.wait(busy);
}

void Admission::change(std::uint64_t by) noexcept {
  busy_.fetch_add(by);
  if (mode_.load() == Mode::closed) busy_.notify_all();
}

bool Admission::enter(Share& share) noexcept {
  busy_.fetch_add(kLooking);
  ++looking_of_thread;
  const Mode mode = mode_.load();
  if (mode == Mode::open || (mode == Mode::round && try_claim(share))) return true;
  --looking_of_thread;
  change(-kLooking);
  if (mode == Mode::closed) wakeup_.notify();
  return false;
}

void Admission::begin() noexcept {
  begun_.fetch_add(1, std::memory_order_relaxed);
  --looking_of_thread;
  change(kRunning - kLooking);
}

void Admission::leave(Share& share, bool has_begun) noexcept {
  if (mode_.load() != Mode::open) {
    const std::lock_guard lock{mutex_};
    if (share.round == round_) settle(1 + (has_begun ? 0 : std::exchange(share.left, 0)));
  }
  if (!has_begun) --looking_of_thread;
  change(has_begun ? -kRunning : -kLooking);
}

void Admission::postpone(Share& share, bool has_begun) noexcept {
  postponed = {.share = &share, .has_begun = has_begun};
}

void Admission::leave_after_failure() noexcept {
  const auto [share, has_begun] = std::exchange(postponed, {});
  if (share != nullptr) leave(*share, has_begun);
}

// --- rounds ---------------------------------------------------------------------------------------

bool Admission::begin_round(const std::function<bool()>& is_cancelled) {
  const std::lock_guard lock{mutex_};
  if (is_cancelled()) return false;
  ++round_;
  unsettled_ = 0;
  begun_.store(0);
  mode_.store(Mode::round);
  return true;
}

void Admission::let_in(Share& share, std::uint64_t instances) noexcept {
  const std::lock_guard lock{mutex_};
  share = {.left = instances, .round = round_};
  unsettled_ += instances;
}

bool Admission::try_claim(Share& share) noexcept {
  const std::lock_guard lock{mutex_};
  if (mode_.load() != Mode::round || share.round != round_ || share.left == 0) return false;
  --share.left;
  return true;
}

void Admission::settle(std::uint64_t instances) noexcept {
  unsettled_ -= instances;
  if (unsettled_ == 0) wakeup_.notify();
}

bool Admission::admits(const Share& share) noexcept {
  const Mode mode = mode_.load();
  if (mode != Mode::round) return mode == Mode::open;
  const std::lock_guard lock{mutex_};
  return share.round == round_ && share.left > 0;
}

void Admission::drop(Share& share) noexcept {
  const std::lock_guard lock{mutex_};
  if (share.round == round_ && share.left > 0) settle(std::exchange(share.left, 0));
}

void Admission::wait_for_round(std::int64_t deadline_ns) noexcept {
  const auto is_over = [this] {
    const std::lock_guard lock{mutex_};
    return unsettled_ == 0 || mode_.load() != Mode::round;
  };
  while (!is_over()) {
    if (wakeup_.wait_until(deadline_ns) == cie::scheduling::WaitResult::timeout) return;
  }
}

}  // namespace cie_rclcpp
