// Hash tables for look-ups per event: one array of slots, probed one after the other.
#pragma once

#include "model/spread_bits.hpp"

#include <array>
#include <bitset>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace cie::analysis {

// Keys are small and copied, values default-constructible. Nothing is ever erased. References and
// pointers to values are void after an insertion. `Hash` must spread well over the upper bits.
template <typename Key, typename Value, typename Hash = SpreadBits>
class FlatMap {
 public:
  // Null: not there.
  const Value* find(const Key& key) const noexcept {
    if (slots_.empty()) return nullptr;
    const auto& slot = slots_[place_of(key)];
    return slot.is_used ? &slot.value : nullptr;
  }
  Value* find(const Key& key) noexcept {
    return const_cast<Value*>(std::as_const(*this).find(key));
  }
  Value& operator[](const Key& key) { return *insert(key).first; }
  // The value, and whether it is new (then it is Value{}).
  std::pair<Value*, bool> insert(const Key& key) {
    if (2 * (used_ + 1) > slots_.size()) grow();
    auto& slot = slots_[place_of(key)];
    const bool is_new = !slot.is_used;
    if (is_new) {
      slot.key = key;
      slot.is_used = true;
      ++used_;
    }
    return {&slot.value, is_new};
  }
  // Calls `visit` with each key and value, in no order.
  template <typename Visit>
  void each(const Visit& visit) const {
    for (const auto& slot : slots_) {
      if (slot.is_used) visit(slot.key, slot.value);
    }
  }

 private:
  struct Slot {
    Key key{};
    bool is_used = false;
    Value value{};
  };

  // The slot that holds the key, or the unused one where it belongs.
  std::size_t place_of(const Key& key) const noexcept {
    auto place = static_cast<std::size_t>(Hash{}(key) >> shift_);
    while (slots_[place].is_used && !(slots_[place].key == key))
      place = (place + 1) & (slots_.size() - 1);
    return place;
  }
  void grow() {
    constexpr std::size_t kFirstSize = 16;
    constexpr unsigned kFirstShift = 60;
    const auto size = slots_.empty() ? kFirstSize : 2 * slots_.size();
    const auto shift = slots_.empty() ? kFirstShift : shift_ - 1;
    auto old = std::exchange(slots_, std::vector<Slot>(size));
    shift_ = shift;
    for (auto& slot : old) {
      if (slot.is_used) slots_[place_of(slot.key)] = std::move(slot);
    }
  }

  std::vector<Slot> slots_;  // a power of two, at most half of them used
  std::size_t used_ = 0;
  unsigned shift_ = 0;
};

// Numbers that are often near each other, as those of threads are, by sixteen.
inline constexpr unsigned kGroupBits = 4;
template <std::integral Number>
Number group_of(Number number) noexcept {
  return number >> kGroupBits;
}
template <std::integral Number>
std::size_t within_group(Number number) noexcept {
  return static_cast<std::size_t>(number) % (std::size_t{1} << kGroupBits);
}

// The same for keys with such numbers: the values of a group lie side by side, most often in one cache
// line. group_of(key) is the key of its group, within_group(key) its place there.
template <typename Key, typename Value, typename Hash = SpreadBits>
class NearMap {
 public:
  // Null: not there.
  const Value* find(const Key& key) const noexcept {
    const auto* group = groups_.find(group_of(key));
    const auto place = within_group(key);
    return group != nullptr && group->is_used[place] ? &group->values[place] : nullptr;
  }
  Value* find(const Key& key) noexcept {
    return const_cast<Value*>(std::as_const(*this).find(key));
  }
  Value& operator[](const Key& key) { return *insert(key).first; }
  // The value, and whether it is new (then it is Value{}).
  std::pair<Value*, bool> insert(const Key& key) {
    auto& group = groups_[group_of(key)];
    const auto place = within_group(key);
    const bool is_new = !group.is_used[place];
    group.is_used.set(place);
    return {&group.values[place], is_new};
  }
  // Calls `visit` with the key of each group, the place within and the value, in no order.
  template <typename Visit>
  void each(const Visit& visit) const {
    groups_.each([&visit](const Key& group, const Group& of_group) {
      for (std::size_t place = 0; place < of_group.values.size(); ++place) {
        if (of_group.is_used[place]) visit(group, place, of_group.values[place]);
      }
    });
  }

 private:
  struct Group {
    std::array<Value, std::size_t{1} << kGroupBits> values{};
    std::bitset<std::size_t{1} << kGroupBits> is_used;
  };

  FlatMap<Key, Group, Hash> groups_;
};

// The same for values that are large: they lie one after the other beside the table, and none moves when
// others are inserted.
template <typename Number, typename Value>
class DenseMap {
 public:
  // Null: not there.
  const Value* find(Number number) const noexcept {
    const auto* place = places_.find(number);
    return place != nullptr ? &value_at(*place) : nullptr;
  }
  Value* find(Number number) noexcept {
    return const_cast<Value*>(std::as_const(*this).find(number));
  }
  Value& operator[](Number number) { return *insert(number).first; }
  std::pair<Value*, bool> insert(Number number) {
    const auto [place, is_new] = places_.insert(number);
    if (is_new) {
      if (used_ % kInBlock == 0) blocks_.push_back(std::make_unique<Block>());
      *place = used_++;
    }
    return {&value_at(*place), is_new};
  }
  // Calls `visit` with each number, in no order.
  template <typename Visit>
  void each_number(const Visit& visit) const {
    places_.each([&visit](Number group, std::size_t within, std::uint32_t /*place*/) {
      visit(static_cast<Number>((group << kGroupBits) + static_cast<Number>(within)));
    });
  }

 private:
  static constexpr std::uint32_t kInBlock = 32;
  using Block = std::array<Value, kInBlock>;

  const Value& value_at(std::uint32_t place) const noexcept {
    return (*blocks_[place / kInBlock])[place % kInBlock];
  }
  Value& value_at(std::uint32_t place) noexcept {
    return const_cast<Value&>(std::as_const(*this).value_at(place));
  }

  NearMap<Number, std::uint32_t> places_;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::uint32_t used_ = 0;
};

}  // namespace cie::analysis
