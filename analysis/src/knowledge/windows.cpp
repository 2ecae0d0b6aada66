#include "windows.hpp"

#include <algorithm>
#include <iterator>

namespace cie::analysis {

void Windows::add(TimeWindow window) {
  if (window.to < window.from) {
    return;
  }
  // Nanoseconds are whole: windows that follow on each other without one between them are one.
  const auto touches = [](Timestamp end, Timestamp begin) {
    return end == kLatest || end.ns + 1 >= begin.ns;
  };
  auto next = ends_.upper_bound(window.from);
  if (next != ends_.begin()) {
    const auto previous = std::prev(next);
    if (touches(previous->second, window.from)) {
      window.from = previous->first;
      window.to = std::max(window.to, previous->second);
      next = ends_.erase(previous);
    }
  }
  while (next != ends_.end() && touches(window.to, next->first)) {
    window.to = std::max(window.to, next->second);
    next = ends_.erase(next);
  }
  ends_.emplace_hint(next, window.from, window.to);
}

std::optional<Timestamp> Windows::end_of_window_at(Timestamp time) const noexcept {
  const auto next = ends_.upper_bound(time);
  if (next == ends_.begin()) {
    return std::nullopt;
  }
  const auto end = std::prev(next)->second;
  return end >= time ? std::optional{end} : std::nullopt;
}

}  // namespace cie::analysis
