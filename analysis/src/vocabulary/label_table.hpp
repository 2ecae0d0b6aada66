// Enumerations of a trace as indices of the labels that a vocabulary asked for.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace cie::analysis {

// Which label asked for a value has; -1: none of them.
class LabelTable {
 public:
  struct Range {
    std::uint64_t low = 0;
    std::uint64_t high = 0;
    std::int16_t label = -1;
  };
  // The first range that holds a value counts. `bias` makes signed values comparable as unsigned.
  LabelTable(std::vector<Range> ranges, std::uint64_t bias);

  std::int16_t find(std::uint64_t value) const noexcept {
    return value < near_.size() ? near_[value] : search(value);
  }

 private:
  std::int16_t search(std::uint64_t value) const noexcept;

  std::vector<Range> ranges_;
  std::uint64_t bias_;
  std::array<std::int16_t, 256> near_{};  // what small values have
};

}  // namespace cie::analysis
