// The simulator's dice: the same numbers for a seed on every platform and standard library.
#pragma once

#include "system.hpp"

#include <cstdint>

namespace cie::sim {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  // SplitMix64 (Steele, Lea, Flood 2014).
  std::uint64_t next() noexcept {
    auto z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31U);
  }
  // least <= result <= most
  Ns between(Ns least, Ns most) noexcept {
    const auto span = static_cast<std::uint64_t>(most - least) + 1;
    return least + static_cast<Ns>(next() % span);
  }
  Ns in(const Range& range) noexcept { return between(range.least, range.most); }
  bool one_in(Ns n) noexcept { return between(1, n) == 1; }

 private:
  std::uint64_t state_;
};

}  // namespace cie::sim
