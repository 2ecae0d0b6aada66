// The gaps of one scope and one set of kinds, in order of time. Gaps that overlap are one; too many are joined to coarser
// ones, never dropped. Insertion and search are logarithmic.
#pragma once

#include "gap.hpp"

#include <cstddef>
#include <map>

namespace cie::analysis {

class GapLane {
 public:
  // What it holds of a gap beside scope, kinds and begin. `used`: events that are known to be among the hidden ones.
  struct Held {
    Gap gap;
    std::uint64_t used = 0;
    bool is_full() const noexcept { return gap.at_most && used >= *gap.at_most; }
  };

  explicit GapLane(std::size_t most_gaps) : most_gaps_{most_gaps} {}

  void add(const Gap& gap);

  // The first gap that ends at or after that time; null if none does.
  const Held* from(Timestamp time) const noexcept;
  // The last one that begins at or before it.
  const Held* until(Timestamp time) const noexcept;

  // One more event is known to be among those that the gap with this begin hides.
  void use(Timestamp begin) noexcept;
  void forget_use() noexcept;
  std::size_t size() const noexcept { return gaps_.size(); }

 private:
  void join_neighbours();

  std::map<Timestamp, Held> gaps_;  // by begin
  std::size_t most_gaps_;
};

}  // namespace cie::analysis
