#include "timer_grid.hpp"

#include <algorithm>
#include <limits>

namespace cie::analysis {
namespace {

constexpr std::uint64_t kLeastPeriod = 100'000;
constexpr std::uint64_t kEnoughLate = 8;

}  // namespace

bool TimerGrid::is_possible(std::uint64_t period_ns) noexcept {
  return period_ns >= kLeastPeriod &&
         period_ns <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
}

std::int64_t TimerGrid::last_until(Timestamp time) const noexcept {
  const auto since = (time - first_).ns;
  return since / period_.ns - (since % period_.ns < 0 ? 1 : 0);
}

std::int64_t TimerGrid::first_from(Timestamp time) const noexcept {
  const auto since = (time - first_).ns;
  return since / period_.ns + (since % period_.ns > 0 ? 1 : 0);
}

std::optional<TimerGrid::Release> TimerGrid::on_start(const Start& start) {
  if (is_refuted_) return std::nullopt;
  if (start.is_inside && !is_inside_) begin_inside();
  is_inside_ = start.is_inside;
  const bool is_first = !has_started_ && !latest_ && !is_cut_;
  const auto until = last_until(start.time);
  const auto release = std::min(latest_.value_or(until), until);
  if (release < earliest_) {
    is_refuted_ = true;
    return std::nullopt;
  }
  const bool is_sole = release == earliest_;
  earliest_ = std::max(earliest_ + 1,
                       start.called_after ? first_from(*start.called_after - kTimerError) : 0);
  latest_ = std::max(release + 1, first_from(start.time));
  const auto expiry = first_ + Duration{release * period_.ns};
  const bool is_served_late =
      is_first && release > 0 && start.served_since.value_or(start.time) <= expiry;
  if (is_served_late) ++unresolved_;
  if (is_sole && !is_believed(expiry, start)) {
    unresolved_ += since_anchor_ + (has_started_ ? 1 : 0);
    since_anchor_ = 0;
    has_started_ = true;
    anchor_.reset();
    return std::nullopt;
  }
  const bool is_next = since_anchor_ == 0;
  const auto missed = skipped_until(release, is_sole);
  if (!is_sole) return std::nullopt;
  if (is_steady_) {
    unproven_ = {};
  } else if (is_inside_) {
    if (unproven_.releases++ == 0) unproven_.since = start.time;
    unproven_.missed += missed.value_or(0);
  }
  return Release{
      .expiry = expiry, .missed = missed, .is_missed_its_own = is_next, .is_prompt = is_steady_};
}

Duration TimerGrid::error() const noexcept {
  return std::max({kTimerError, highest_floor_, last_prompt_});
}

bool TimerGrid::is_believed(Timestamp expiry, const Start& start) {
  const auto latency = start.time - expiry;
  if (latency <= prompt()) {
    ++prompt_;
    is_confirmed_ = true;
    is_steady_ = true;
    last_prompt_ = latency;
    step_.add(start.time - std::max(expiry, start.after.value_or(expiry)));  // no one's doing
    floor_ = std::min(floor_, latency);
    if (prompt_ % kEnoughPrompt == 0) {
      highest_floor_ = std::max(highest_floor_, floor_);
      floor_ = prompt();
    }
    return true;
  }
  is_steady_ = false;
  if (start.busy_since && *start.busy_since <= expiry + prompt()) return is_confirmed_;
  is_confirmed_ = false;
  ++late_;
  is_refuted_ = late_ >= kEnoughLate && is_mostly_late();
  return false;
}

// What was skipped before the first instance inside was so outside.
void TimerGrid::begin_inside() noexcept {
  unresolved_ = 0;
  unproven_ = {};
  since_anchor_ = 0;
  anchor_.reset();
  has_started_ = false;
  is_cut_ = !latest_;
}

// What was skipped before the first instance is the application's start, as far as nothing ran.
std::optional<std::uint32_t> TimerGrid::skipped_until(std::int64_t release, bool is_known) {
  if (!has_started_) {
    has_started_ = true;
    if (is_known || !is_cut_) anchor_ = release;
    return 0;
  }
  if (is_known && !anchor_) {
    unresolved_ += since_anchor_ + 1;
    since_anchor_ = 0;
    anchor_ = release;
    return std::nullopt;
  }
  ++since_anchor_;
  if (!is_known || !anchor_) return std::nullopt;
  const auto skipped = release - *anchor_ - static_cast<std::int64_t>(since_anchor_);
  anchor_ = release;
  since_anchor_ = 0;
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(skipped, 0, std::numeric_limits<std::uint32_t>::max()));
}

void TimerGrid::begin_after(const std::optional<Timestamp>& start) noexcept {
  if (start) {
    latest_ = first_from(*start);
  } else {
    is_cut_ = true;
  }
}

void TimerGrid::lose() noexcept {
  latest_.reset();
  unresolved_ += since_anchor_;
  since_anchor_ = 0;
  anchor_.reset();
}

}  // namespace cie::analysis
