// What belongs to each kind of parameter.
#pragma once

#include <cie/executor/parameters.hpp>

#include <array>
#include <cstddef>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace cie::executor {

inline constexpr std::size_t kKinds = std::variant_size_v<ParameterValue>;
static_assert(static_cast<std::size_t>(ParameterKind::string_array) + 1 == kKinds);

// A kind is the number that it has in ROS 2, and the place of its type in ParameterValue and of its
// name here. As rclcpp writes them, but for "not set".
inline constexpr std::array<std::string_view, kKinds> kKindNames{
    "nothing",    "bool",       "integer",       "double",       "string",
    "byte_array", "bool_array", "integer_array", "double_array", "string_array"};

template <typename T>
inline constexpr bool kIsList = false;
template <typename T>
inline constexpr bool kIsList<std::vector<T>> = true;

// The kind whose values are of type T.
template <typename T>
inline constexpr ParameterKind kKindOf = []<std::size_t... I>(std::index_sequence<I...>) {
  std::size_t kind = 0;
  ((std::is_same_v<T, std::variant_alternative_t<I, ParameterValue>> ? void(kind = I) : void()),
   ...);
  return static_cast<ParameterKind>(kind);
}
(std::make_index_sequence<kKinds>{});

// Calls `function` with a value, as it is without contents, of this kind's type; with monostate for
// a number that is no kind.
template <std::size_t I = 1, typename Function>
auto with_type_of(ParameterKind kind, const Function& function) {
  if constexpr (I == kKinds) {
    return function(std::monostate{});
  } else {
    if (static_cast<std::size_t>(kind) != I) return with_type_of<I + 1>(kind, function);
    return function(std::variant_alternative_t<I, ParameterValue>{});
  }
}

}  // namespace cie::executor
