// A total that a subject counts up and some of its events tell: by how much it rose within a window.
// Between two events that do not follow each other it may have risen at any time.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace cie::analysis {

class RunningTotal {
 public:
  // In the order of the events. `before`: what it was just before the event, at most.
  void see_before(std::uint64_t total) noexcept {
    at_begin_ = std::max(at_begin_, total);
    at_end_ = std::max(at_end_, total);
  }
  void see_inside(std::uint64_t before, std::uint64_t total) noexcept {
    if (!most_at_begin_) most_at_begin_ = before;
    at_end_ = std::max(at_end_, total);
  }
  void see_after(std::uint64_t before) noexcept {
    if (!most_at_begin_) most_at_begin_ = before;
    if (!most_at_end_) most_at_end_ = before;
  }
  // Nothing had been counted when the window began.
  void begin_with_none() noexcept { most_at_begin_ = 0; }

  std::uint64_t least_rise() const noexcept {
    const auto begin = std::max(most_at_begin_.value_or(at_begin_), at_begin_);
    return at_end_ - std::min(at_end_, begin);
  }
  std::uint64_t most_rise() const noexcept {
    return std::max(most_at_end_.value_or(at_end_), at_end_) - at_begin_;
  }

 private:
  std::uint64_t at_begin_ = 0;  // at least, as the other one
  std::uint64_t at_end_ = 0;
  std::optional<std::uint64_t> most_at_begin_;
  std::optional<std::uint64_t> most_at_end_;
};

}  // namespace cie::analysis
