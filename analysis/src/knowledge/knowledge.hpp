// What a recording does not show, and what is known of it all the same. An execution is consistent with a recording if it
// holds every event recorded and differs from it only inside gaps; proofs and counts say what a gap cannot hide. Whoever
// judges, or pairs events while they still come, asks one question: may all of these be hidden at once?
//
// Not thread-safe, but const functions may run side by side.
#pragma once

#include "gap.hpp"
#include "gap_lane.hpp"
#include "proofs.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

namespace cie::analysis {

class Knowledge {
 public:
  // Whether the event, of a thread that is named, may have been emitted on that CPU; without an answer, it may.
  using MayBeOn = std::function<bool(const Hidden&, std::int32_t cpu)>;

  explicit Knowledge(MayBeOn may_be_on = {}, std::size_t most_gaps_of_a_scope = 4096);
  // The gaps and proofs of another one.
  Knowledge(const Knowledge& other, MayBeOn may_be_on);

  // Events may be missing there.
  void add(const Gap& gap);

  // Nothing of these kinds that belongs to the subject is hidden within the window, its ends included.
  void discharge(EventKinds kinds, const Scope& subject, TimeWindow window);

  // An event that is hidden for certain, by numbers or totals: it uses up the count of a gap.
  void expect(const Hidden& hidden);

  // Which gaps those expected use up, if only one gap may hide them. Until it is called they use up none, and more
  // seems possible than is.
  void settle();

  // The earliest gap that may hide the first of these where other gaps, or the same one, hide the others; null: it is
  // proven that not all are hidden. Never null where an execution that hides them is consistent with the recording; where one is
  // not, it may still name a gap. Valid until the next add().
  const Gap* gap(std::span<const Hidden> all) const;
  const Gap* gap(const Hidden& one) const { return gap({&one, 1}); }
  // That of the first of these that is possible; null: none is.
  const Gap* any_gap(std::span<const Conjunction> each) const;

  // The CPUs of the gaps that may hide it; an empty one: of a gap that may be any CPU's.
  std::vector<std::optional<std::int32_t>> cpus(const Hidden& hidden) const;

  // When it happened, if it is hidden: within the gaps that may hide it, from the first to the last one.
  TimeWindow bounds(const Hidden& hidden) const;

 private:
  struct Lane {
    Scope scope;
    EventKinds kinds;
    GapLane gaps;
  };
  // A gap that may hide an event.
  struct Place {
    std::size_t lane = 0;
    const GapLane::Held* held = nullptr;
  };
  // Where one of several hidden events may be: in room that a gap has left, or as one of those that use up a gap.
  struct Choice {
    const GapLane::Held* held = nullptr;
    std::size_t expected = 0;  // if held is null
  };
  using LaneKey =
      std::tuple<std::optional<HostIndex>, std::optional<std::int32_t>, std::optional<ProcessIndex>,
                 std::optional<ThreadIndex>, std::optional<CallbackIndex>, EventKinds>;

  std::vector<std::size_t>& lanes_of(const Scope& scope);
  template <typename Visit>
  void for_each_place(const Hidden& hidden, const Visit& visit) const;
  template <typename Visit>
  bool visit_lane(std::size_t lane, const Hidden& hidden, const Visit& visit) const;
  std::optional<Timestamp> first_unproven(const Hidden& hidden, EventKinds kinds,
                                          TimeWindow window) const;
  bool reaches(const Lane& lane, const Hidden& hidden) const;
  bool may_be(const Hidden& hidden, const Hidden& expected) const;
  std::vector<Choice> choices(const Hidden& hidden, std::size_t enough, bool& is_unbounded) const;

  template <typename Visit>
  void for_each_lane(const Hidden& hidden, const Visit& visit) const;

  MayBeOn may_be_on_;
  std::size_t most_gaps_;
  std::vector<Lane> lanes_;
  std::map<LaneKey, std::size_t> lane_of_;
  std::vector<std::size_t> wide_lanes_;  // of no process, thread or callback
  std::unordered_map<std::uint32_t, std::vector<std::size_t>>
      process_lanes_;  // of no thread or callback
  std::unordered_map<std::uint64_t, std::vector<std::size_t>> subject_lanes_;  // of one, by it
  EventKinds of_threads_;    // kinds of subject_lanes_
  EventKinds of_callbacks_;  // likewise
  Proofs proofs_;
  std::vector<Hidden> expected_;
  std::vector<bool> uses_;  // of each: whether it uses up the count of the one gap that may hide it
  std::unordered_map<std::uint64_t, std::vector<std::size_t>>
      expected_of_;  // by callback and thread
};

}  // namespace cie::analysis
