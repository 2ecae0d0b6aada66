// The values of extremes apart from their witnesses: these are written now and then, the values are
// looked at for every instance.
#pragma once

#include <cie/analysis/time.hpp>

#include <cstdint>
#include <limits>

namespace cie::analysis {

struct Greatest {
  static constexpr auto kNone = std::numeric_limits<std::int64_t>::min();
  std::int64_t value = kNone;
  // Whether `other` is the first value or above it, which it then becomes.
  bool rise(Duration other) noexcept {
    if (value >= other.ns && other.ns != kNone) return false;
    value = other.ns;
    return true;
  }
};

struct Least {
  static constexpr auto kNone = std::numeric_limits<std::int64_t>::max();
  std::int64_t value = kNone;
  bool fall(Duration other) noexcept {
    if (value <= other.ns && other.ns != kNone) return false;
    value = other.ns;
    return true;
  }
};

}  // namespace cie::analysis
