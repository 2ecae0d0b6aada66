// What a misspelt name was probably meant to be: for options of commands, and ids of a spec.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace cie {

// The candidate that `name` was probably meant to be; empty if none is near. The first of those
// that are equally near.
std::string_view nearest_name(std::string_view name, const std::vector<std::string>& candidates);
// "; did you mean "verify"?", or nothing.
std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

}  // namespace cie
