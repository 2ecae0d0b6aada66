#include "label_table.hpp"

#include <cstddef>
#include <utility>

namespace cie::analysis {

LabelTable::LabelTable(std::vector<Range> ranges, std::uint64_t bias)
    : ranges_(std::move(ranges)), bias_(bias) {
  for (std::size_t value = 0; value < near_.size(); ++value) {
    near_[value] = search(value);
  }
}

std::int16_t LabelTable::search(std::uint64_t value) const noexcept {
  for (const auto& range : ranges_) {
    if ((value ^ bias_) >= range.low && (value ^ bias_) <= range.high) return range.label;
  }
  return -1;
}

}  // namespace cie::analysis
