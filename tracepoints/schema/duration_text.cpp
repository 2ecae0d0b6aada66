#include <cie/tracepoints/duration_text.hpp>

#include "base/text.hpp"

#include <array>
#include <string_view>
#include <utility>

namespace cie {
namespace {

constexpr std::array<std::pair<std::string_view, std::int64_t>, 5> kUnits{
    {{"ns", 1}, {"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}, {"min", 60'000'000'000}}};

// "1.5" in units of `unit` ns.
std::optional<std::int64_t> scaled(std::string_view number, std::int64_t unit) noexcept {
  const auto point = number.find('.');
  const auto whole = parse_digits(number.substr(0, point));
  std::int64_t ns = 0;
  if (!whole || __builtin_mul_overflow(*whole, unit, &ns)) return std::nullopt;
  if (point == std::string_view::npos) return ns;
  const auto fraction = number.substr(point + 1);
  if (fraction.empty()) return std::nullopt;
  for (const char digit : fraction) {
    if (digit < '0' || digit > '9') return std::nullopt;
    if (unit % 10 != 0) {  // finer than a nanosecond
      if (digit != '0') return std::nullopt;
      continue;
    }
    unit /= 10;
    if (__builtin_add_overflow(ns, unit * (digit - '0'), &ns)) return std::nullopt;
  }
  return ns;
}

}  // namespace

std::optional<std::int64_t> parse_digits(std::string_view text) noexcept {
  return text.starts_with('-') ? std::nullopt : parse_number<std::int64_t>(text);
}

std::optional<std::int64_t> parse_duration(std::string_view text) noexcept {
  for (const auto& [name, unit] : kUnits) {
    if (!text.ends_with(name)) continue;
    if (const auto ns = scaled(text.substr(0, text.size() - name.size()), unit)) return ns;
  }
  return std::nullopt;
}

}  // namespace cie
