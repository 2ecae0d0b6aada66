// What a tracker keeps of each subject of the model: a vector that grows as subjects appear.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace cie::analysis {

// References are void after access to an index that was not there before.
template <typename Index, typename Value>
class ByIndex {
 public:
  Value& operator[](Index index) {
    const auto place = static_cast<std::size_t>(index);
    if (place >= values_.size()) values_.resize(place + 1);
    return values_[place];
  }
  // Null: never written to.
  const Value* find(Index index) const noexcept {
    const auto place = static_cast<std::size_t>(index);
    return place < values_.size() ? &values_[place] : nullptr;
  }
  Value* find(Index index) noexcept { return const_cast<Value*>(std::as_const(*this).find(index)); }

  auto begin() noexcept { return values_.begin(); }
  auto end() noexcept { return values_.end(); }

 private:
  std::vector<Value> values_;
};

}  // namespace cie::analysis
