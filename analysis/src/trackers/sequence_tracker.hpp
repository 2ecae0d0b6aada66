// Watches contiguous numbers of one subject. A number may come a little late (two threads of one
// publisher), so a hole counts only if it is never filled.
#pragma once

#include <cie/analysis/rare.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <vector>

namespace cie::analysis {

class SequenceTracker {
 public:
  // A number after the last one, of which no tracker needs to know. False: it is another one.
  static bool observe_next(std::uint64_t number, const EventRef& where,
                           SequenceFacts& facts) noexcept {
    const bool is_next =
        facts.last && !facts.is_restarted && number - *facts.last == 1 && number != 0;
    if (!is_next) return false;
    ++facts.count;
    facts.last = number;
    facts.last_at = where;
    return true;
  }
  void observe(std::uint64_t number, const EventRef& where, SequenceFacts& facts) {
    if (!observe_next(number, where, facts)) observe_other(number, where, facts);
  }
  // A number that came after the part that is judged: those missing up to the first one may lie in it.
  void observe_beyond(std::uint64_t number, const EventRef& where, const SequenceFacts& facts);
  // Whether `number` lies in a hole: between the first and the last one seen, itself not seen.
  bool is_missing(std::uint64_t number) const noexcept;
  // Whether it certainly was seen: of what came before many holes nobody knows any more.
  bool is_seen(std::uint64_t number, const SequenceFacts& facts) const noexcept {
    return facts.first && number >= *facts.first && number <= *facts.last &&
           number >= untracked_until_ && !is_missing(number);
  }
  // Whether any number in (after, until] may be in a hole: of what came before many holes nobody
  // knows any more.
  bool has_hole_between(std::uint64_t after, std::uint64_t until) const noexcept;
  // A new series begins: the next number is expected to be 0.
  static void restart(SequenceFacts& facts) noexcept { facts.is_restarted = true; }
  // Totals the holes, with the one between a promised first number and the first one seen. May be
  // called again after more numbers.
  void finish(std::uint64_t promised, const EventRef& promised_at, SequenceFacts& facts) const;
  void finish(SequenceFacts& facts) const;
  // The same where numbers below the promised one may have been left out.
  void finish_from(std::uint64_t promised, const EventRef& promised_at, SequenceFacts& facts) const;

 private:
  void observe_other(std::uint64_t number, const EventRef& where, SequenceFacts& facts);
  void forget_oldest_but_first();
  void total_holes(SequenceFacts& facts, std::uint64_t from = 0) const;
  // The one up to the first number beyond.
  void add_hole_beyond(std::uint64_t expected, const EventRef& before, SequenceFacts& facts) const;

  struct Beyond {
    std::uint64_t number = 0;
    EventRef at;
  };
  struct Hole {
    std::uint64_t begin = 0;  // first missing number
    std::uint64_t end = 0;    // one past the last
    EventRef before;
    EventRef after;
  };
  Rare<Beyond> beyond_;                // the least that is not below the last one seen
  std::vector<Hole> holes_;            // ascending, at most kMaxKeptHoles
  std::uint64_t untracked_ = 0;        // missing numbers beyond kMaxKeptHoles holes
  std::uint64_t untracked_until_ = 0;  // all of them are lower
};

}  // namespace cie::analysis
