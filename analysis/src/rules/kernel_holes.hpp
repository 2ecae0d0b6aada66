// Where the kernel's record of a machine is not whole: what happened there nobody knows.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"
#include "model/kernel_record.hpp"

#include <map>
#include <optional>
#include <vector>

namespace cie::analysis {

Evidence evidence_of(const Loss& loss);
// The kernel's record of a machine is without so many of its CPUs.
Evidence evidence_of_missing_cpus(std::uint32_t cpus, std::optional<Timestamp> time);
// A loss of the domain before the window that was asked for, which lasted until `time` or longer;
// null: none.
const Loss* loss_before(const Model& model, HostIndex host, Domain domain, Timestamp time);

// Of the kernel's traces that are evidence.
class KernelHoles {
 public:
  // `model` is borrowed.
  explicit KernelHoles(const Model& model);

  // A hole between the two, edges included; empty: there is none.
  std::optional<Evidence> between(HostIndex host, Timestamp begin, Timestamp end) const;
  // The same, or the record began later than the first of the two.
  std::optional<Evidence> since(HostIndex host, Timestamp begin, Timestamp end) const;
  // The record began later than the first of the two, or ended before the second.
  std::optional<Evidence> outside(HostIndex host, Timestamp begin, Timestamp end) const;
  // Priorities were recorded between the two without what tells whether they are inherited.
  std::optional<Evidence> untold_inheritance(HostIndex host, Timestamp begin, Timestamp end) const;

 private:
  struct Interval {
    Timestamp begin;
    Timestamp end;
    const Loss* loss;  // null: no stream's record is there of some CPU
    // That of this one ended before; null: the record of other CPUs began with the hole.
    const StreamFacts* ends = nullptr;
    // That of this one begins behind it; null: none does.
    const StreamFacts* begins = nullptr;
  };
  using Holes = std::map<HostIndex, std::vector<Interval>>;

  // Where some kernel streams of a machine have begun or have not ended, and others not, and between
  // two recordings: what happened on the CPUs of those is unknown.
  void find_edges(Holes& holes);
  void add_holes(HostIndex host, Stretch all, const std::vector<Stretch>& stretches,
                 std::vector<Interval>& holes) const;
  void merge(Holes& holes);
  std::optional<Evidence> begun_later(HostIndex host, Timestamp begin) const;
  static Evidence evidence_of_hole(const Interval& hole);

  const Model& model_;
  Holes holes_;                            // disjoint, ascending
  std::map<HostIndex, Timestamp> begins_;  // when its record of all CPUs began
  std::map<HostIndex, Timestamp> ends_;    // when the last of them has ended, if all have
  std::map<HostIndex, std::vector<const StreamFacts*>> without_inheritance_;
  std::map<HostIndex, std::vector<Stretch>> with_inheritance_;  // if some are without
};

}  // namespace cie::analysis
