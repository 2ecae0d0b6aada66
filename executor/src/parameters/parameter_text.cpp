#include <cie/executor/parameters.hpp>

#include "parameter_kinds.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <type_traits>
#include <utility>

namespace cie {
namespace {

using executor::kIsList;
using executor::kKindOf;

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
T parsed(std::string_view name, const std::string& text) {
  T value{};
  if (!parse(text, value)) fail(name, text, kWanted<T>);
  return value;
}

ParameterValue value_of(std::string_view name, const ParameterText& text, auto value) {
  using Value = decltype(value);
  if constexpr (kIsList<Value>) {
    if (!text.is_list) fail(name, text.texts.front(), "a list");
    for (const std::string& each : text.texts)
      value.push_back(parsed<typename Value::value_type>(name, each));
    return value;
  } else {
    if (text.is_list) fail(name, "a list", "a single value");
    return parsed<Value>(name, text.texts.front());
  }
}

template <typename T>
bool fits(const ParameterText& text) {
  T value{};
  return !text.texts.empty() && std::ranges::all_of(text.texts, [&](const std::string& each) {
    return parse(each, value);
  });
}

ParameterKind guessed_kind(const ParameterText& text) {
  const auto kind = [&]<typename T>(T) {
    return text.is_list ? kKindOf<std::vector<T>> : kKindOf<T>;
  };
  if (fits<bool>(text)) return kind(bool{});
  if (fits<std::int64_t>(text)) return kind(std::int64_t{});
  if (fits<double>(text)) return kind(double{});
  return kind(std::string{});
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
  return executor::kKindNames.at(static_cast<std::size_t>(kind));
}

ParameterValue parse_parameter(std::string_view name, const ParameterText& text,
                               ParameterKind kind) {
  if (kind == ParameterKind::not_set) kind = guessed_kind(text);
  return executor::with_type_of(kind, [&](auto value) -> ParameterValue {
    if constexpr (std::is_same_v<decltype(value), std::monostate>) {
      return value;
    } else {
      return value_of(name, text, std::move(value));
    }
  });
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
