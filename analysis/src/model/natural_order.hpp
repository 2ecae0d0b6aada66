#pragma once

#include <compare>
#include <string_view>

namespace cie::analysis {

// Orders texts as readers expect, numbers in them by value: "thread 9" before "thread 10".
std::weak_ordering natural_order(std::string_view a, std::string_view b);

}  // namespace cie::analysis
