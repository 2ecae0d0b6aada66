// The last few values of a series.
#pragma once

#include "base/prefetch.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace cie::analysis {

// Remembers the last `kCapacity` values, a power of two. Memory grows with what is remembered.
template <typename T, std::size_t kCapacity>
class Recent {
  static_assert((kCapacity & (kCapacity - 1)) == 0 && kCapacity < std::size_t{1} << 31U);

 public:
  template <typename Value = T>
  [[gnu::always_inline]] void push(Value&& value) {
    if (size_ < kCapacity) {
      if (size_ == values_.capacity()) grow();
      values_.push_back(std::forward<Value>(value));
      ++size_;
    } else {
      values_[next_] = std::forward<Value>(value);
    }
    next_ = (next_ + 1) & (kCapacity - 1);
  }
  // Brings into the cache, ahead of the next push, what `address_of` says of the value it replaces.
  template <typename AddressOf>
  void prefetch_oldest(AddressOf address_of) const {
    if (size() == kCapacity) prefetch_to_write(address_of(values_[next_]));
  }
  // Brings into the cache where the next value goes.
  void prefetch_place() const noexcept {
    prefetch_lines(values_.data() + next_, values_.data() + next_ + 1);
  }
  std::size_t size() const noexcept { return size_; }
  // 0: the latest; below size().
  const T& newest(std::size_t age) const noexcept {
    return values_[(next_ - 1 - age) & (kCapacity - 1)];
  }
  T& newest(std::size_t age) noexcept { return values_[(next_ - 1 - age) & (kCapacity - 1)]; }
  // Oldest first.
  template <typename Visit>
  void for_each(Visit visit) {
    for (auto age = size(); age-- > 0;)
      visit(values_[(next_ - 1 - age) & (kCapacity - 1)]);
  }
  // The latest one of which `is_wanted` holds; null if it holds of none.
  template <typename Predicate>
  const T* find_newest(Predicate is_wanted) const {
    for (std::size_t age = 0; age < size(); ++age) {
      if (is_wanted(newest(age))) return &newest(age);
    }
    return nullptr;
  }

 private:
  // In few steps: there are many series, and most have more values than are remembered.
  [[gnu::noinline]] void grow() {
    const auto size = size_ < 16 ? 4 * std::max<std::size_t>(size_, 1) : std::size_t{2} * size_;
    values_.reserve(std::min(kCapacity, size));
  }

  std::vector<T> values_;
  std::uint32_t size_ = 0;  // of values_, whose own size() is a division
  std::uint32_t next_ = 0;  // where the next value goes
};

}  // namespace cie::analysis
