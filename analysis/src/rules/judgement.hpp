// One subject on its way to a verdict: what a rule claims of it, in words.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "base/text.hpp"
#include "knowledge/claims.hpp"
#include "model/facts.hpp"
#include "model/subjects.hpp"

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis {

// A point in time without an event of its own. One that is not known is kEarliest, for an EventRef has
// no room for an optional.
inline EventRef moment(std::optional<Timestamp> time,
                       std::optional<std::int64_t> tid = std::nullopt) {
  return {.time = time.value_or(kEarliest),
          .stream = kNoStream,
          .cpu = std::nullopt,
          .pid = std::nullopt,
          .tid = tid};
}

// Of a time that is not known, be it kEarliest or kBoot, the evidence has none.
std::optional<Timestamp> time_of_evidence(Timestamp time) noexcept;
Evidence evidence(std::string event, const EventRef& where, std::string note);
// Of what the recording has no event of: `where` is but a position.
inline Evidence without_event(const EventRef& where, std::string note) {
  return evidence({}, where, std::move(note));
}

// Of a callback of ROS 2's, which is known by an address.
inline constexpr std::string_view kPerhapsAnothers =
    "may be another callback's: its address was told of before events were lost, and not since, or "
    "also by what may be another process of this pid";

// "8 ns".
inline std::string nanoseconds(std::int64_t value) { return std::to_string(value) + " ns"; }
inline std::string nanoseconds(Duration value) { return nanoseconds(value.ns); }

// Of an instance that is over though no event told its end: an exception left it. A service whose
// callback takes the request alone, to respond later, has such instances too: rclcpp tells no end then.
Evidence untold_end(const CallbackFacts& callback, const OpenInstance& left);

class RecordedKnowledge;

// Claims of which each violation shows some events. Rules that do not claim what they need report what is missing
// themselves.
class Judgement : public Claims<std::vector<Evidence>> {
 public:
  static constexpr std::size_t kMaxEvidence = kMostShown;  // a witness is complete with far fewer

  // `known` must outlive it.
  Judgement(NamedSubject subject, const RecordedKnowledge& known);

  // A witness of the violation, or one more event of it.
  void fail(Evidence witness);
  // The same of `make()`, which is only called where the verdict has a place for it.
  template <std::invocable Make>
  void fail(const Make& make) {
    if (!is_full()) fail(make());
  }
  bool has_witness() const noexcept { return !witnesses_.empty() || verdict() == Verdict::fail; }
  // So many witnesses that another one is not kept, and no doubt is told.
  bool is_full() const noexcept {
    const bool is_proven = verdict() == Verdict::fail;
    return witnesses_.size() >= kMaxEvidence ||
           (is_proven && Claims::witnesses().size() >= kMostShown);
  }
  // Something that is missing and without which the subject does not pass.
  void doubt(Evidence reason);
  template <std::invocable Make>
  void doubt(const Make& make) {
    if (witnesses_.empty() && doubts_.size() < kMaxEvidence) doubt(make());
  }
  void doubt(const std::optional<Evidence>& reason);
  // Something that is missing and without which neither a pass nor a violation is proven.
  void overrule(Evidence reason);
  void overrule(const std::optional<Evidence>& reason);
  // Worth saying although the subject passes.
  void remark(Evidence note);
  template <std::invocable Make>
  void remark(const Make& make) {
    if (remarks_.size() < kMaxEvidence) remark(make());
  }

  // Empty when nothing was judged and nothing is missing: the rule does not apply.
  std::optional<SubjectVerdict> finish() &&;

 private:
  NamedSubject subject_;
  const RecordedKnowledge* known_;
  std::vector<Evidence> witnesses_;
  std::vector<Evidence> overruling_;
  std::vector<Evidence> doubts_;
  std::vector<Evidence> remarks_;
};

// Adds the verdict, if there is one, to a rule's verdicts.
void conclude(Judgement&& judgement, std::vector<SubjectVerdict>& verdicts);

}  // namespace cie::analysis
