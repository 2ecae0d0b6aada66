// Which instances of a thread are around one another. Viewers draw a thread as slices in slices,
// which only holds where they nest.
#pragma once

#include <cie/analysis/identity.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// Of one thread, as viewers know it. Ask in order of time, at one time the outer before the inner.
template <typename T>
class Nesting {
 public:
  // `end` empty: never. False: it ends after one that it began in; it is not entered.
  bool enter(std::int64_t start, std::optional<std::int64_t> end, T value) {
    const auto own_end = end.value_or(kNever);
    while (!open_.empty() && open_.back().end <= start)
      open_.pop_back();
    if (!open_.empty() && open_.back().end < own_end) return false;
    open_.push_back({own_end, std::move(value)});
    return true;
  }

  // The process that what follows is of. Pids and tids are given again: what another one left open
  // has ended. Returns how many had no end of their own.
  std::size_t change_process(analysis::ProcessIndex process) {
    if (process_ == process) return 0;
    process_ = process;
    const auto unended = std::ranges::count(open_, kNever, &Open::end);
    open_.clear();
    return static_cast<std::size_t>(unended);
  }

  // The innermost one around a moment, its edges included; null if there is none.
  const T* around(std::int64_t time) {
    while (!open_.empty() && open_.back().end < time)
      open_.pop_back();
    return open_.empty() ? nullptr : &open_.back().value;
  }

 private:
  struct Open {
    std::int64_t end = 0;
    T value;
  };
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();
  analysis::ProcessIndex process_{};
  std::vector<Open> open_;  // outermost first
};

}  // namespace cie::viewer_export
