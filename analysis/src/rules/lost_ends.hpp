// Threads whose end was not recorded, though it was told.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::analysis {

class LostEnds {
 public:
  explicit LostEnds(const Model& model);
  // In a process that ended in order every thread tells its end, unless it was replaced: why what ran
  // on this one may have run after it had ended, or on another one with its tid. Of a thread that was
  // not announced the same, where an announcement is missing.
  std::optional<Evidence> of(ThreadIndex thread) const;

 private:
  const Model& model_;
  std::vector<std::uint64_t> announced_;    // threads, by process
  std::vector<Timestamp> last_activities_;  // by callback, on whatever thread
};

}  // namespace cie::analysis
