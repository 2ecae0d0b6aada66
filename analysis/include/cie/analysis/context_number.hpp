// A number of an event's context that may be absent, in a quarter of std::optional's room.
#pragma once

#include <compare>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace cie::analysis {

// A CPU, process or thread. `Number` is how others hold it; the kernel's own are int, and what no int
// holds, as only a forged trace says, counts as absent.
template <std::signed_integral Number>
class ContextNumber {
 public:
  constexpr ContextNumber() noexcept = default;
  // NOLINTBEGIN(google-explicit-constructor): it stands for an optional
  constexpr ContextNumber(std::nullopt_t /*absent*/) noexcept {}
  constexpr ContextNumber(Number number) noexcept
      : number_(std::in_range<std::int32_t>(number) ? static_cast<std::int32_t>(number) : kAbsent) {
  }
  constexpr ContextNumber(std::optional<Number> number) noexcept
      : ContextNumber(number ? ContextNumber(*number) : ContextNumber()) {}
  constexpr operator std::optional<Number>() const noexcept {
    return has_value() ? std::optional<Number>(number_) : std::nullopt;
  }
  // NOLINTEND(google-explicit-constructor)
  constexpr bool has_value() const noexcept { return number_ != kAbsent; }
  constexpr explicit operator bool() const noexcept { return has_value(); }
  // Only where there is one.
  constexpr Number operator*() const noexcept { return number_; }
  constexpr Number value_or(Number otherwise) const noexcept {
    return has_value() ? number_ : otherwise;
  }
  constexpr void reset() noexcept { number_ = kAbsent; }
  // Of two of them: std::optional's own == would find absent and absent different.
  friend constexpr bool operator==(const ContextNumber&, const ContextNumber&) noexcept = default;
  friend constexpr auto operator<=>(const ContextNumber&, const ContextNumber&) noexcept = default;

 private:
  static constexpr std::int32_t kAbsent = std::numeric_limits<std::int32_t>::min();
  std::int32_t number_ = kAbsent;
};

}  // namespace cie::analysis
