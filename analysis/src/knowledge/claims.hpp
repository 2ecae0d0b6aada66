// What a rule says of one subject, and the one evaluator of it:
//
//   FAIL           a violation of which no excuse is possible: it is there in every consistent execution
//   INCONCLUSIVE   one with a possible excuse; or something that the subject needs may be hidden
//   PASS           neither, and something was judged
//   NOT_APPLICABLE neither, and nothing was
//
// An excuse, and a need, is a conjunction: events that would all have to be hidden. Each is asked at once, so claims take
// the memory of one witness, however many are made.
#pragma once

#include "cie/analysis/verdict.hpp"
#include "knowledge.hpp"

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace cie::analysis {

using Conjunction = std::vector<Hidden>;

// `Witness`: what shows a violation. The first one that is certain is kept, else the first one.
template <typename Witness>
class Claims {
 public:
  explicit Claims(const Knowledge& knowledge) : knowledge_{&knowledge} {}

  void checked(std::uint64_t count = 1) noexcept { checked_ += count; }

  // Proven unless one of the excuses is possible.
  void violation(Witness witness, std::span<const Conjunction> excuses = {}) {
    if (is_proven_) {
      return;
    }
    const Gap* possible = nullptr;
    for (const auto& excuse : excuses) {
      possible = knowledge_->gap(excuse);
      if (possible != nullptr) {
        break;
      }
    }
    is_proven_ = possible == nullptr;
    if (is_proven_ || !witness_) {
      witness_ = std::move(witness);
    }
    if (possible != nullptr && !excuse_) {
      excuse_ = possible->reason;
    }
  }
  void violation(Witness witness, std::initializer_list<Conjunction> excuses) {
    violation(std::move(witness), std::span{excuses.begin(), excuses.size()});
  }

  // Passes only if these are not all hidden: they would be, or would make, a violation.
  void needs(std::span<const Hidden> hidden) {
    if (is_proven_ || witness_ || need_) {
      return;
    }
    if (const auto* possible = knowledge_->gap(hidden)) {
      need_ = possible->reason;
    }
  }
  void needs(std::initializer_list<Hidden> hidden) {
    needs(std::span{hidden.begin(), hidden.size()});
  }

  Verdict verdict() const noexcept {
    if (is_proven_) {
      return Verdict::fail;
    }
    if (witness_ || need_) {
      return Verdict::inconclusive;
    }
    return checked_ > 0 ? Verdict::pass : Verdict::not_applicable;
  }

  std::uint64_t count() const noexcept { return checked_; }
  // Of FAIL: what shows it. Of INCONCLUSIVE: the violation that may have an excuse.
  const std::optional<Witness>& witness() const noexcept { return witness_; }
  // Of INCONCLUSIVE: the gap's.
  std::optional<Reason> reason() const noexcept {
    if (verdict() != Verdict::inconclusive) {
      return std::nullopt;
    }
    return witness_ ? excuse_ : need_;
  }

 private:
  const Knowledge* knowledge_;
  std::uint64_t checked_ = 0;
  bool is_proven_ = false;
  std::optional<Witness> witness_;
  std::optional<Reason> excuse_;
  std::optional<Reason> need_;
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
