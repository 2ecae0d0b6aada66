#include "sequence_tracker.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {
constexpr std::size_t kMaxKeptHoles = 256;
}

// Not the number after the last one.
void SequenceTracker::observe_other(std::uint64_t number, const EventRef& where,
                                    SequenceFacts& facts) {
  ++facts.count;
  if (!facts.first) {
    facts.first = facts.last = number;
    facts.first_at = facts.last_at = where;
    facts.is_restarted = false;
    return;
  }
  if (facts.is_restarted) {
    facts.is_restarted = false;
    facts.last = number;
    facts.last_at = where;
    if (number != 0) {
      untracked_ += number;
      untracked_until_ = std::max(untracked_until_, number);
    }
    return;
  }
  const auto last = *facts.last;
  if (number > last) {
    if (holes_.size() >= kMaxKeptHoles) forget_oldest_but_first();
    holes_.push_back(
        Hole{.begin = last + 1, .end = number, .before = facts.last_at, .after = where});
    facts.last = number;
    facts.last_at = where;
    return;
  }
  if (number < *facts.first) {
    if (*facts.first - number > 1 && holes_.size() < kMaxKeptHoles) {
      holes_.insert(
          holes_.begin(),
          Hole{.begin = number + 1, .end = *facts.first, .before = where, .after = facts.first_at});
    }
    facts.first = number;
    facts.first_at = where;
    return;
  }
  for (auto hole = holes_.begin(); hole != holes_.end(); ++hole) {
    if (number < hole->begin || number >= hole->end) continue;
    const auto right =
        Hole{.begin = number + 1, .end = hole->end, .before = hole->before, .after = hole->after};
    hole->end = number;
    const bool left_is_empty = hole->begin == hole->end;
    if (right.begin < right.end) {
      if (left_is_empty) {
        *hole = right;
      } else {
        holes_.insert(hole + 1, right);
      }
    } else if (left_is_empty) {
      holes_.erase(hole);
    }
    return;
  }
  ++facts.repeated;
}

// What is asked of holes is near the last number most often.
void SequenceTracker::forget_oldest_but_first() {
  const auto oldest = holes_.begin() + 1;
  untracked_ += oldest->end - oldest->begin;
  untracked_until_ = std::max(untracked_until_, oldest->end);
  holes_.erase(oldest);
}

void SequenceTracker::observe_beyond(std::uint64_t number, const EventRef& where,
                                     const SequenceFacts& facts) {
  if (facts.last && number <= *facts.last) return;
  if (!beyond_ || number < beyond_->number) beyond_ = Beyond{.number = number, .at = where};
}

bool SequenceTracker::is_missing(std::uint64_t number) const noexcept {
  return std::any_of(holes_.begin(), holes_.end(), [number](const Hole& hole) {
    return number >= hole.begin && number < hole.end;
  });
}

bool SequenceTracker::has_hole_between(std::uint64_t after, std::uint64_t until) const noexcept {
  if (after + 1 < untracked_until_) return true;  // it may have one
  return std::any_of(holes_.begin(), holes_.end(), [after, until](const Hole& hole) {
    return hole.begin <= until && hole.end > after + 1;
  });
}

void SequenceTracker::total_holes(SequenceFacts& facts, std::uint64_t from) const {
  facts.missing += untracked_;
  for (const auto& hole : holes_) {
    const auto begin = std::max(hole.begin, from);
    if (begin >= hole.end) continue;
    facts.missing += hole.end - begin;
    if (!facts.first_gap) {
      facts.first_gap = SequenceGap{
          .expected = begin, .seen = hole.end, .before = hole.before, .after = hole.after};
    }
  }
}

void SequenceTracker::add_hole_beyond(std::uint64_t expected, const EventRef& before,
                                      SequenceFacts& facts) const {
  if (!beyond_ || facts.is_restarted || beyond_->number <= expected) return;
  facts.missing += beyond_->number - expected;
  if (!facts.first_gap) {
    facts.first_gap = SequenceGap{
        .expected = expected, .seen = beyond_->number, .before = before, .after = beyond_->at};
  }
}

void SequenceTracker::finish(SequenceFacts& facts) const {
  facts.missing = 0;
  facts.first_gap.reset();
  total_holes(facts);
  if (facts.last) add_hole_beyond(*facts.last + 1, facts.last_at, facts);
}

void SequenceTracker::finish(std::uint64_t promised, const EventRef& promised_at,
                             SequenceFacts& facts) const {
  finish_from(promised, promised_at, facts);
  // Numbers below it came before it was promised.
  if (facts.first && *facts.first < promised) finish(facts);
}

void SequenceTracker::finish_from(std::uint64_t promised, const EventRef& promised_at,
                                  SequenceFacts& facts) const {
  facts.missing = 0;
  facts.first_gap.reset();
  if (facts.first && *facts.first > promised) {
    facts.missing += *facts.first - promised;
    facts.first_gap = SequenceGap{
        .expected = promised, .seen = *facts.first, .before = promised_at, .after = facts.first_at};
  }
  total_holes(facts, promised);
  if (facts.last && *facts.last >= promised) {
    add_hole_beyond(*facts.last + 1, facts.last_at, facts);
  } else {
    add_hole_beyond(promised, promised_at, facts);
  }
}

}  // namespace cie::analysis
