// What a rule says of one subject, and the one evaluator of it:
//
//   FAIL           a violation of which no excuse is possible: it is there in every consistent execution
//   INCONCLUSIVE   one with a possible excuse; or something that the subject needs may be hidden
//   PASS           neither, and something was judged
//   NOT_APPLICABLE neither, and nothing was
//
// An excuse, and a need, is a conjunction: events that would all have to be hidden. Each is asked at once, so claims take
// the memory of what they show, which is bounded, however many are made.
#pragma once

#include "cie/analysis/verdict.hpp"
#include "knowledge.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::analysis {

// `Witness`: what shows a violation.
template <typename Witness>
class Claims {
 public:
  static constexpr std::size_t kMostShown = 64;  // witnesses, and reasons

  explicit Claims(const Knowledge& knowledge) : knowledge_{&knowledge} {}

  void checked(std::uint64_t count = 1) noexcept { checked_ += count; }

  // Proven unless one of the excuses is possible. `witness`: or a function that makes it, called where it is kept.
  template <typename Shown>
  void violation(Shown&& witness, std::span<const Conjunction> excuses = {}) {
    if (is_proven_ && witnesses_.size() == kMostShown) {
      return;
    }
    const auto* possible = knowledge_->any_gap(excuses);
    if (possible == nullptr && !is_proven_) {
      is_proven_ = true;
      witnesses_.clear();
    }
    if (possible != nullptr) {
      add(excuses_, possible->reason);
    }
    if (is_proven_ == (possible == nullptr) && witnesses_.size() < kMostShown) {
      if constexpr (std::is_invocable_r_v<Witness, Shown>) {
        witnesses_.push_back(witness());
      } else {
        witnesses_.push_back(std::forward<Shown>(witness));
      }
    }
  }
  template <typename Shown>
  void violation(Shown&& witness, std::initializer_list<Conjunction> excuses) {
    violation(std::forward<Shown>(witness), std::span{excuses.begin(), excuses.size()});
  }

  // Passes only if these are not all hidden: they would be, or would make, a violation.
  void needs(std::span<const Hidden> hidden) {
    if (is_proven_ || needs_.size() == kMostShown) {
      return;
    }
    if (const auto* possible = knowledge_->gap(hidden)) {
      add(needs_, possible->reason);
    }
  }
  void needs(std::initializer_list<Hidden> hidden) {
    needs(std::span{hidden.begin(), hidden.size()});
  }

  // The same of each.
  void needs_none(std::span<const Conjunction> each) {
    for (const auto& hidden : each) {
      needs(hidden);
    }
  }

  Verdict verdict() const noexcept {
    if (is_proven_) {
      return Verdict::fail;
    }
    if (!witnesses_.empty() || !needs_.empty()) {
      return Verdict::inconclusive;
    }
    return checked_ > 0 ? Verdict::pass : Verdict::not_applicable;
  }

  std::uint64_t count() const noexcept { return checked_; }
  // Of FAIL: what shows it. Of INCONCLUSIVE: the violations that may have an excuse.
  const std::vector<Witness>& witnesses() const noexcept { return witnesses_; }
  // Of INCONCLUSIVE: those of the gaps, of excuses first.
  std::vector<Reason> reasons() const {
    if (verdict() != Verdict::inconclusive) {
      return {};
    }
    auto all = excuses_;
    for (const auto& reason : needs_) {
      add(all, reason);
    }
    return all;
  }

 private:
  static void add(std::vector<Reason>& reasons, const Reason& reason) {
    if (reasons.size() < kMostShown &&
        std::find(reasons.begin(), reasons.end(), reason) == reasons.end()) {
      reasons.push_back(reason);
    }
  }

  const Knowledge* knowledge_;
  std::uint64_t checked_ = 0;
  bool is_proven_ = false;
  std::vector<Witness> witnesses_;
  std::vector<Reason> excuses_;
  std::vector<Reason> needs_;
};

// Of two kinds of evidence the second, the kernel's, never takes from the first what it decided: FAIL if either fails,
// else the first one's verdict if it judged anything, else the second one's (law L6).
constexpr Verdict of_both(Verdict first, Verdict second) noexcept {
  if (first == Verdict::fail || second == Verdict::fail) {
    return Verdict::fail;
  }
  return first == Verdict::not_applicable ? second : first;
}

}  // namespace cie::analysis
