#include "gap_lane.hpp"

#include <algorithm>
#include <iterator>

namespace cie::analysis {
namespace {

// `gap` covers both from now on. Why the earlier one is there stands for both.
void join(Gap& gap, const Gap& other) {
  if (other.window.from < gap.window.from) {
    gap.reason = other.reason;
  }
  gap.window = {.from = std::min(gap.window.from, other.window.from),
                .to = std::max(gap.window.to, other.window.to)};
  if (gap.at_most && other.at_most) {
    *gap.at_most += *other.at_most;
  } else {
    gap.at_most.reset();
  }
}

}  // namespace

void GapLane::add(const Gap& gap) {
  if (gap.window.to < gap.window.from || gap.at_most == 0U) {
    return;
  }
  Gap joined = gap;
  auto next = gaps_.upper_bound(gap.window.to);
  while (next != gaps_.begin()) {
    const auto previous = std::prev(next);
    if (previous->second.gap.window.to < gap.window.from) {
      break;
    }
    join(joined, previous->second.gap);
    next = gaps_.erase(previous);
  }
  gaps_.emplace_hint(next, joined.window.from, Held{.gap = joined});
  if (gaps_.size() > most_gaps_) {
    join_neighbours();
  }
}

const GapLane::Held* GapLane::from(Timestamp time) const noexcept {
  const auto* before = until(time);
  if (before != nullptr && before->gap.window.to >= time) {
    return before;
  }
  const auto next = gaps_.upper_bound(time);
  return next == gaps_.end() ? nullptr : &next->second;
}

const GapLane::Held* GapLane::until(Timestamp time) const noexcept {
  const auto next = gaps_.upper_bound(time);
  return next == gaps_.begin() ? nullptr : &std::prev(next)->second;
}

void GapLane::use(Timestamp begin) noexcept {
  if (const auto found = gaps_.find(begin); found != gaps_.end()) {
    ++found->second.used;
  }
}

void GapLane::forget_use() noexcept {
  for (auto& [begin, held] : gaps_) {
    held.used = 0;
  }
}

// Half as many, so that this happens once in as many insertions as are kept.
void GapLane::join_neighbours() {
  for (auto first = gaps_.begin(); first != gaps_.end(); ++first) {
    const auto second = std::next(first);
    if (second == gaps_.end()) {
      return;
    }
    join(first->second.gap, second->second.gap);
    first->second.used += second->second.used;
    gaps_.erase(second);
  }
}

}  // namespace cie::analysis
