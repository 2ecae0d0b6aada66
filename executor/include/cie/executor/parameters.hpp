// Named values of a node that can be asked for and set while it runs, as in ROS 2.
#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace cie {

// The types of ROS 2, in the order of their numbers there. monostate: not set.
using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<std::uint8_t>,
                 std::vector<bool>, std::vector<std::int64_t>, std::vector<double>,
                 std::vector<std::string>>;
enum class ParameterKind : std::uint8_t {
  not_set,
  bool_,  // NOLINT(readability-identifier-naming): "bool" is a keyword
  integer,
  double_,  // NOLINT(readability-identifier-naming): likewise
  string,
  byte_array,
  bool_array,
  integer_array,
  double_array,
  string_array
};

namespace executor {
template <typename T, typename Variant>
inline constexpr bool kIsAlternative = false;
template <typename T, typename... Types>
inline constexpr bool kIsAlternative<T, std::variant<Types...>> = (std::same_as<T, Types> || ...);
}  // namespace executor
template <typename T>
concept ParameterType =
    executor::kIsAlternative<T, ParameterValue> && !std::same_as<T, std::monostate>;

inline ParameterKind kind_of(const ParameterValue& value) noexcept {
  return static_cast<ParameterKind>(value.index());
}
// "integer", "string_array": for messages.
std::string_view kind_name(ParameterKind kind) noexcept;

struct Parameter {
  std::string name;
  ParameterValue value;
};

// Both ends belong to the range. A step other than 0 admits only from + n * step, and `to`.
struct IntegerRange {
  std::int64_t from = 0;
  std::int64_t to = 0;
  std::uint64_t step = 0;
};
struct FloatingPointRange {
  double from = 0;
  double to = 0;
  double step = 0;
};

struct ParameterDescriptor {
  std::string description{};
  std::string additional_constraints{};  // in words, for people
  bool is_read_only = false;             // its value is that of its declaration
  bool is_dynamically_typed = false;     // may change its type
  std::optional<IntegerRange> integer_range{};
  std::optional<FloatingPointRange> floating_point_range{};
};

// Whether parameters were set, and if not, why.
struct SetParametersResult {
  bool is_successful = true;
  std::string reason{};
};

// Wrong use: a parameter that is not declared, or is declared twice, or has another type; an
// initial value that does not fit. The text names the parameter.
class ParameterError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Asked before parameters are set: these values, all at once, or a reason why not. On the thread
// that sets them, one call at a time for each node: the caller's, or "cie-parameters" for those who
// ask over the network. May ask for parameters, must not declare or set any of this node.
using OnSetParameters =
    std::function<SetParametersResult(const std::vector<Parameter>& parameters)>;
// Told after they were set, on the same thread; may set others.
using PostSetParameters = std::function<void(const std::vector<Parameter>& parameters)>;

// A parameter's value as files and command lines have it: one text, or a list of them.
struct ParameterText {
  std::vector<std::string> texts{};
  bool is_list = false;
};
// By parameter: values instead of those of the declarations.
using ParameterOverrides = std::map<std::string, ParameterText, std::less<>>;

// The value of this kind that the text stands for (bool: true or false; numbers: decimal); of the
// first kind that fits of bool, integer, double, string for not_set. Throws
// std::invalid_argument naming the parameter.
ParameterValue parse_parameter(std::string_view name, const ParameterText& text,
                               ParameterKind kind = ParameterKind::not_set);
// "true", "-10", "[front, rear]".
std::string to_text(const ParameterValue& value);
// What a command line gives: "10", "[front, rear]".
ParameterText parameter_text(std::string_view text);

}  // namespace cie
