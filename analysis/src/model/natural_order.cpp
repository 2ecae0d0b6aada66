#include "natural_order.hpp"

#include <algorithm>
#include <cstddef>

namespace cie::analysis {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::weak_ordering natural_order(std::string_view a, std::string_view b) {
  // What they begin with alike, up to a number that goes on.
  auto alike = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  while (alike > 0 && is_digit(a[alike - 1]))
    --alike;
  a.remove_prefix(alike);
  b.remove_prefix(alike);
  while (!a.empty() && !b.empty()) {
    if (!is_digit(a.front()) || !is_digit(b.front())) {
      if (a.front() != b.front()) return a <=> b;  // whose characters have no sign
      a.remove_prefix(1);
      b.remove_prefix(1);
      continue;
    }
    const auto take = [](std::string_view& text) {
      const auto end = std::min(text.find_first_not_of("0123456789"), text.size());
      auto digits = text.substr(0, end);
      text.remove_prefix(end);
      digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
      return digits;
    };
    const auto x = take(a);
    const auto y = take(b);
    if (x.size() != y.size()) return x.size() <=> y.size();
    if (x != y) return x <=> y;
  }
  return a.size() <=> b.size();
}

}  // namespace cie::analysis
