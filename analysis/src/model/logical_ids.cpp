#include "logical_ids.hpp"

#include <algorithm>
#include <cctype>

namespace cie::analysis {

std::string_view without_number(std::string_view id) {
  const auto mark = id.rfind('#');
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const bool is_numbered = mark != std::string_view::npos && mark + 1 < id.size() &&
                           std::ranges::all_of(id.substr(mark + 1), is_digit);
  return is_numbered ? id.substr(0, mark) : id;
}

IdParts::IdParts(std::string_view id) {
  const auto plain = without_number(id);
  const auto mark = std::min(plain.find('@'), plain.size());
  node = plain.substr(0, mark);
  what = plain.substr(mark);
}

}  // namespace cie::analysis
