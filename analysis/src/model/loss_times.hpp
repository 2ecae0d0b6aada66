// When events of applications were lost, as far as the trace has been read.
#pragma once

#include <cie/analysis/event.hpp>

#include "by_index.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace cie::analysis {

// What has no number of its own may have been among them: two events that nothing was seen between
// need not have followed each other. By host; times of its clock.
class LossTimes {
 public:
  void add(HostIndex host, Timestamp begin, Timestamp end) {
    is_any_ = true;
    auto& losses = losses_[host];
    // They are told in order of their begins, but for clocks that run backwards. So many that do not
    // overlap are taken together.
    constexpr std::size_t kMost = 100'000;
    if (losses.empty() || (begin > losses.back().end && losses.size() < kMost)) {
      losses.push_back({.begin = begin, .end = end});
      return;
    }
    auto& last = losses.back();
    last = {.begin = std::min(last.begin, begin), .end = std::max(last.end, end)};
  }
  // Whether one overlaps the time between the two, in whatever order. The event that a loss ends with
  // follows it.
  bool any_between(HostIndex host, Timestamp one, Timestamp other) const {
    if (!is_any_) return false;
    const auto [begin, end] = std::minmax(one, other);
    const auto* losses = losses_.find(host);
    if (losses == nullptr) return false;
    const auto first = std::ranges::upper_bound(*losses, begin, {}, &Interval::end);
    return first != losses->end() && first->begin <= end;
  }

 private:
  struct Interval {
    Timestamp begin;
    Timestamp end;
  };
  ByIndex<HostIndex, std::vector<Interval>> losses_;  // in order, none overlaps another
  bool is_any_ = false;
};

}  // namespace cie::analysis
