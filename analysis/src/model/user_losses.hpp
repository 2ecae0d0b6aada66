// Where events of applications were lost, when all of the trace has been read: what is not numbered may have
// been among them. While it is being read there is LossTimes (loss_times.hpp), which has no witnesses.
#pragma once

#include "facts.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace cie::analysis {

// Of the user's traces that are evidence. Refers to the model's losses.
class UserLosses {
 public:
  explicit UserLosses(const Model& model);
  // One that overlaps the two, edges included; null: there is none.
  const Loss* between(HostIndex host, Timestamp begin, Timestamp end) const;
  // The CPUs of which some do; an empty one: of one or more nothing tells of which CPU it is.
  std::vector<std::optional<std::int32_t>> cpus_between(HostIndex host, Timestamp begin,
                                                        Timestamp end) const;

 private:
  struct UpTo {
    Timestamp begin;
    const Loss* last;  // of those that began no later, the one that ended last
  };
  using ByBegin = std::vector<UpTo>;
  static void sort(ByBegin& losses);
  static const Loss* between(const ByBegin& losses, Timestamp begin, Timestamp end);

  std::map<HostIndex, ByBegin> losses_;
  std::map<HostIndex, std::map<std::optional<std::int32_t>, ByBegin>> of_cpus_;
};

}  // namespace cie::analysis
