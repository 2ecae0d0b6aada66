// A point in time that may be unknown, in half of std::optional's room.
#pragma once

#include <cie/analysis/time.hpp>

#include <limits>
#include <optional>

namespace cie::analysis {

// The least time that 64 bits hold, some 292 years before a machine was switched on, counts as unknown.
class OptionalTime {
 public:
  constexpr OptionalTime() noexcept = default;
  // NOLINTBEGIN(google-explicit-constructor): it stands for an optional
  constexpr OptionalTime(Timestamp time) noexcept : time_(time) {}
  constexpr OptionalTime(std::optional<Timestamp> time) noexcept : time_(time.value_or(kUnknown)) {}
  constexpr operator std::optional<Timestamp>() const noexcept {
    return has_value() ? std::optional<Timestamp>(time_) : std::nullopt;
  }
  // NOLINTEND(google-explicit-constructor)
  constexpr bool has_value() const noexcept { return time_ != kUnknown; }
  constexpr explicit operator bool() const noexcept { return has_value(); }
  // Only where there is one.
  constexpr Timestamp operator*() const noexcept { return time_; }

 private:
  static constexpr Timestamp kUnknown{std::numeric_limits<std::int64_t>::min()};
  Timestamp time_ = kUnknown;
};

}  // namespace cie::analysis
