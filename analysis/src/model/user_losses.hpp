// Where events of applications were lost: what is not numbered may have been among them.
#pragma once

#include "facts.hpp"

#include <map>
#include <vector>

namespace cie::analysis {

// Of the user's traces that are evidence. Refers to the model's losses.
class UserLosses {
 public:
  explicit UserLosses(const Model& model);
  // One that overlaps the two, edges included; null: there is none.
  const Loss* between(HostIndex host, Timestamp begin, Timestamp end) const;

 private:
  struct UpTo {
    Timestamp begin;
    const Loss* last;  // of those that began no later, the one that ended last
  };
  std::map<HostIndex, std::vector<UpTo>> losses_;  // by begin
};

}  // namespace cie::analysis
