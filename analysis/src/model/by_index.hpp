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
  ByIndex() = default;
  ByIndex(const ByIndex&) = delete;
  ByIndex& operator=(const ByIndex&) = delete;

  Value& operator[](Index index) {
    const auto place = static_cast<std::size_t>(index);
    if (place >= size_) [[unlikely]]
      grow(place + 1);
    return data_[place];
  }
  // Null: never written to.
  const Value* find(Index index) const noexcept {
    const auto place = static_cast<std::size_t>(index);
    return place < size_ ? data_ + place : nullptr;
  }
  Value* find(Index index) noexcept { return const_cast<Value*>(std::as_const(*this).find(index)); }

  auto begin() noexcept { return values_.begin(); }
  auto end() noexcept { return values_.end(); }

 private:
  void grow(std::size_t size) {
    values_.resize(size);
    data_ = values_.data();
    size_ = size;
  }

  std::vector<Value> values_;
  // Of values_, whose own size() is a division.
  Value* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace cie::analysis
