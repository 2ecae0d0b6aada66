// Hash tables for look-ups per event: one array of slots, probed one after the other.
#pragma once

#include "model/spread_bits.hpp"

#include <array>
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

// The same for values that are large, by numbers that are often near each other, as those of threads
// are: values lie one after the other beside the table, and none moves when others are inserted.
template <typename Number, typename Value>
class DenseMap {
 public:
  // Null: not there.
  const Value* find(Number number) const noexcept {
    const auto* near = places_.find(group_of(number));
    if (near == nullptr) return nullptr;
    const auto place = (*near)[within_group(number)];
    return place == 0 ? nullptr : &value_at(place);
  }
  Value* find(Number number) noexcept {
    return const_cast<Value*>(std::as_const(*this).find(number));
  }
  Value& operator[](Number number) { return *insert(number).first; }
  std::pair<Value*, bool> insert(Number number) {
    auto& place = places_[group_of(number)][within_group(number)];
    const bool is_new = place == 0;
    if (is_new) {
      if (used_ % kInBlock == 0) blocks_.push_back(std::make_unique<Block>());
      place = ++used_;
    }
    return {&value_at(place), is_new};
  }
  // Calls `visit` with each number, in no order.
  template <typename Visit>
  void each_number(const Visit& visit) const {
    places_.each([&visit](Number group, const Places& places) {
      for (std::size_t within = 0; within < places.size(); ++within) {
        if (places[within] != 0)
          visit(static_cast<Number>((group << kGroupBits) + static_cast<Number>(within)));
      }
    });
  }

 private:
  // Those of a group are looked up in one cache line.
  static constexpr unsigned kGroupBits = 4;
  static constexpr std::uint32_t kInBlock = 32;
  using Places = std::array<std::uint32_t, std::size_t{1} << kGroupBits>;  // from 1 on; 0: none
  using Block = std::array<Value, kInBlock>;

  static Number group_of(Number number) noexcept { return number >> kGroupBits; }
  static std::size_t within_group(Number number) noexcept {
    return static_cast<std::size_t>(number) % Places{}.size();
  }
  const Value& value_at(std::uint32_t place) const noexcept {
    return (*blocks_[(place - 1) / kInBlock])[(place - 1) % kInBlock];
  }
  Value& value_at(std::uint32_t place) noexcept {
    return const_cast<Value&>(std::as_const(*this).value_at(place));
  }

  FlatMap<Number, Places> places_;
  std::vector<std::unique_ptr<Block>> blocks_;
  std::uint32_t used_ = 0;
};

}  // namespace cie::analysis
