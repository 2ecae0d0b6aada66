#include <cie/executor/parameters.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <type_traits>

namespace cie {
namespace {

// As rclcpp writes them, but for "not set".
constexpr std::array<std::string_view, 10> kKindNames{
    "nothing",    "bool",       "integer",       "double",       "string",
    "byte_array", "bool_array", "integer_array", "double_array", "string_array"};

[[noreturn]] void fail(std::string_view name, const std::string& text, std::string_view wanted) {
  throw std::invalid_argument{"parameter \"" + std::string{name} + "\" is \"" + text +
                              "\"; write " + std::string{wanted}};
}

template <typename Number>
bool parse(const std::string& text, Number& number) {
  const char* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && parsed == end;
}
bool parse(const std::string& text, bool& value) {
  value = text == "true";
  return value || text == "false";
}
bool parse(const std::string& text, std::string& value) {
  value = text;
  return true;
}

template <typename T>
constexpr std::string_view kWanted = "text";
template <>
constexpr std::string_view kWanted<bool> = "true or false";
template <>
constexpr std::string_view kWanted<std::int64_t> = "a whole number of 64 bits";
template <>
constexpr std::string_view kWanted<double> = "a number";
template <>
constexpr std::string_view kWanted<std::uint8_t> = "whole numbers of 0 to 255";

template <typename T>
ParameterValue single(std::string_view name, const ParameterText& text) {
  if (text.is_list) fail(name, "a list", "a single value");
  T value{};
  if (!parse(text.texts.front(), value)) fail(name, text.texts.front(), kWanted<T>);
  return value;
}

template <typename T>
ParameterValue list(std::string_view name, const ParameterText& text) {
  if (!text.is_list) fail(name, text.texts.front(), "a list");
  std::vector<T> values;
  for (const std::string& each : text.texts) {
    T value{};
    if (!parse(each, value)) fail(name, each, kWanted<T>);
    values.push_back(value);
  }
  return values;
}

template <typename T>
bool are_all(const ParameterText& text) {
  T value{};
  for (const std::string& each : text.texts) {
    if (!parse(each, value)) return false;
  }
  return true;
}

ParameterKind guessed_kind(const ParameterText& text) {
  if (are_all<bool>(text) && !text.texts.empty()) {
    return text.is_list ? ParameterKind::bool_array : ParameterKind::bool_;
  }
  if (are_all<std::int64_t>(text) && !text.texts.empty()) {
    return text.is_list ? ParameterKind::integer_array : ParameterKind::integer;
  }
  if (are_all<double>(text) && !text.texts.empty()) {
    return text.is_list ? ParameterKind::double_array : ParameterKind::double_;
  }
  return text.is_list ? ParameterKind::string_array : ParameterKind::string;
}

std::string text_of(bool value) { return value ? "true" : "false"; }
std::string text_of(const std::string& value) { return value; }
template <typename Number>
std::string text_of(Number value) {
  std::array<char, 32> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  std::string text{buffer.data(), end};
  const bool looks_whole = text.find_first_not_of("-0123456789") == std::string::npos;
  if (std::is_floating_point_v<Number> && looks_whole) text += ".0";
  return text;
}
template <typename T>
std::string text_of(const std::vector<T>& values) {
  std::string text;
  for (const auto& value : values)
    text.append(text.empty() ? "" : ", ").append(text_of(static_cast<T>(value)));
  return "[" + text + "]";
}
std::string text_of(std::monostate) { return ""; }

}  // namespace

std::string_view kind_name(ParameterKind kind) noexcept {
  return kKindNames.at(static_cast<std::size_t>(kind));
}

ParameterValue parse_parameter(std::string_view name, const ParameterText& text,
                               ParameterKind kind) {
  switch (kind) {
    case ParameterKind::bool_:
      return single<bool>(name, text);
    case ParameterKind::integer:
      return single<std::int64_t>(name, text);
    case ParameterKind::double_:
      return single<double>(name, text);
    case ParameterKind::string:
      return single<std::string>(name, text);
    case ParameterKind::byte_array:
      return list<std::uint8_t>(name, text);
    case ParameterKind::bool_array:
      return list<bool>(name, text);
    case ParameterKind::integer_array:
      return list<std::int64_t>(name, text);
    case ParameterKind::double_array:
      return list<double>(name, text);
    case ParameterKind::string_array:
      return list<std::string>(name, text);
    case ParameterKind::not_set:
      break;
  }
  return parse_parameter(name, text, guessed_kind(text));
}

std::string to_text(const ParameterValue& value) {
  return std::visit([](const auto& each) { return text_of(each); }, value);
}

ParameterText parameter_text(std::string_view text) {
  if (!text.starts_with('[') || !text.ends_with(']')) return {.texts = {std::string{text}}};
  ParameterText list{.is_list = true};
  text = text.substr(1, text.size() - 2);
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find(','));
    text.remove_prefix(std::min(item.size() + 1, text.size()));
    const auto first = std::min(item.find_first_not_of(' '), item.size());
    const auto last = item.find_last_not_of(' ');
    list.texts.emplace_back(last == std::string_view::npos ? std::string_view{}
                                                           : item.substr(first, last + 1 - first));
  }
  return list;
}

}  // namespace cie
