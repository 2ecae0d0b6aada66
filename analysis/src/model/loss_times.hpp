// When events of applications were lost, as far as the trace has been read: for whoever pairs events
// meanwhile. Whoever judges afterwards takes UserLosses (user_losses.hpp), which has evidence of each loss.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/analysis/identity.hpp>

#include "by_index.hpp"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <vector>

namespace cie::analysis {

// What has no number of its own may have been among them: two events that nothing was seen between
// need not have followed each other. By host; times of its clock.
class LossTimes {
 public:
  void add(HostIndex host, Timestamp begin, Timestamp end) {
    is_any_ = true;
    auto& [losses, begins, ends] = losses_[host];
    // They are told in order of their begins, but for clocks that run backwards. So many that do not
    // overlap are taken together.
    constexpr std::size_t kMost = 100'000;
    const auto insert = [](std::deque<Timestamp>& bounds, Timestamp bound) {
      bounds.insert(std::ranges::upper_bound(bounds, bound), bound);
      if (bounds.size() > kMost) bounds.pop_front();
    };
    insert(begins, begin);
    insert(ends, end);
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
    const auto* of_host = losses_.find(host);
    if (of_host == nullptr) return false;
    const auto& losses = of_host->losses;
    const auto first = std::ranges::upper_bound(losses, begin, {}, &Interval::end);
    return first != losses.end() && first->begin <= end;
  }
  // Whether one begins or ends between the two events. Tracers lose events behind the last one of a
  // packet: what lies within it in one stream most likely lacks nothing. The first event may be that
  // last one: where its packet ends with it, the loss begins in its nanosecond.
  bool any_bound_between(HostIndex host, Timestamp first, Timestamp second) const {
    if (!is_any_) return false;
    const auto* of_host = losses_.find(host);
    if (of_host == nullptr) return false;
    const auto& [losses, begins, ends] = *of_host;
    const auto begin = std::ranges::lower_bound(begins, first);
    if (begin != begins.end() && *begin <= second) return true;
    const auto end = std::ranges::upper_bound(ends, first);
    return end != ends.end() && *end <= second;
  }

 private:
  struct Interval {
    Timestamp begin;
    Timestamp end;
  };
  struct OfHost {
    std::vector<Interval> losses;  // in order, none overlaps another
    // In order, before any were taken together.
    std::deque<Timestamp> begins;
    std::deque<Timestamp> ends;
  };
  ByIndex<HostIndex, OfHost> losses_;
  bool is_any_ = false;
};

}  // namespace cie::analysis
