// One subject on its way to a verdict: what a rule claims of it, in words.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "knowledge/claims.hpp"
#include "model/facts.hpp"
#include "model/subjects.hpp"

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
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
Evidence evidence(std::string event, const EventRef& where, Note note);
// Of what the recording has no event of: `where` is but a position.
inline Evidence without_event(const EventRef& where, Note note) {
  return evidence({}, where, std::move(note));
}

// Of a callback of ROS 2's, which is known by an address: "may be another callback's: …".
inline Note perhaps_anothers_note() { return note("perhaps-anothers"); }
// "…: other announcements may be missing, too".
inline Note others_missing_too(Note what) {
  return note("others-missing-too", {{"what", std::move(what)}});
}

// Of an instance that is over though no event told its end: an exception left it. A service whose
// callback takes the request alone, to respond later, has such instances too: rclcpp tells no end then.
Evidence untold_end(const CallbackFacts& callback, const OpenInstance& left);

class RecordedKnowledge;

// Claims of which each violation shows some events; and what the subject needs to be seen, which is more than that
// nothing of it is hidden.
class Judgement : public Claims<std::vector<Evidence>> {
 public:
  static constexpr std::size_t kMaxEvidence = kMostShown;  // a witness is complete with far fewer

  // `known` must outlive it.
  Judgement(NamedSubject subject, const RecordedKnowledge& known);

  bool has_witness() const noexcept { return verdict() == Verdict::fail; }
  // It has as many witnesses as it keeps, and shows nothing else.
  bool is_full() const noexcept { return has_witness() && witnesses().size() >= kMostShown; }

  // It needs to be seen, and the recording does not show it: passes only without.
  void unseen(Evidence what);
  void unseen(const std::optional<Evidence>& what);
  void unseen(const std::vector<Evidence>& each);
  template <std::invocable Make>
  void unseen(const Make& make) {
    if (!has_witness() && unseen_.size() < kMaxEvidence) unseen(make());
  }
  // A violation only with something that is unseen; empty: it is one.
  void violation_unless(const std::vector<Evidence>& is_unseen, std::vector<Evidence> witness,
                        std::span<const Conjunction> excuses = {});

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
  std::vector<Evidence> unseen_;
  std::vector<Evidence> remarks_;
};

// Those that there are.
std::vector<Evidence> listed(std::initializer_list<std::optional<Evidence>> all);

// Adds the verdict, if there is one, to a rule's verdicts.
void conclude(Judgement&& judgement, std::vector<SubjectVerdict>& verdicts);

}  // namespace cie::analysis
