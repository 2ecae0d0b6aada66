// From where to where something was recorded, as far as that is known while the trace is read.
#pragma once

#include <cie/analysis/time.hpp>

#include <optional>

namespace cie::analysis {

// Part of the time line that a channel covers in all its streams, or the kernel's traces that are evidence,
// as far as events in order of time have shown it yet. An empty begin: not every stream has begun, so the
// window lies ahead. An empty end: no stream has ended.
struct CoveredWindow {
  std::optional<Timestamp> begin;
  std::optional<Timestamp> end;

  bool contains(Timestamp from, Timestamp to) const noexcept {
    return begin && *begin <= from && (!end || to <= *end);
  }
  bool excludes(Timestamp from, Timestamp to) const noexcept {
    return !begin || to < *begin || (end && from > *end);
  }
};

}  // namespace cie::analysis
