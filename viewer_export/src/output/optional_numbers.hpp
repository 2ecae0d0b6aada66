// Numbers that may be unknown, kept flat and trivially copyable: records that are sorted and
// spilled consist of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>

namespace cie::viewer_export {

// `Number` enumerates them from 0.
template <typename Number, std::size_t kCount>
class OptionalNumbers {
 public:
  // `T`: an integer, or a type with nanoseconds `ns`.
  template <typename T>
  void keep(Number number, const std::optional<T>& value) {
    if (!value) return;
    known_ |= 1U << static_cast<unsigned>(number);
    if constexpr (std::is_integral_v<T>) {
      numbers_[number] = *value;
    } else {
      numbers_[number] = value->ns;
    }
  }
  void forget(Number number) noexcept {
    known_ &= ~(1U << static_cast<unsigned>(number));
    numbers_[number] = 0;
  }
  bool is_known(Number number) const noexcept {
    return (known_ >> static_cast<unsigned>(number) & 1U) != 0;
  }
  // 0 if it is unknown.
  std::int64_t value(Number number) const noexcept { return numbers_[number]; }
  // What keep() was given.
  template <typename T>
  std::optional<T> get(Number number) const {
    if (!is_known(number)) return std::nullopt;
    if constexpr (std::is_integral_v<T>) {
      return static_cast<T>(numbers_[number]);
    } else {
      return T{numbers_[number]};
    }
  }

 private:
  static_assert(kCount <= 32);

  std::uint32_t known_ = 0;  // a bit for each
  std::array<std::int64_t, kCount> numbers_{};
};

}  // namespace cie::viewer_export
