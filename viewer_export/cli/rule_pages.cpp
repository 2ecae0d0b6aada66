#include "rule_pages.hpp"

#include "command_line.hpp"
#include "rules/rule.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

namespace cie::cli {

std::string rule_list() {
  std::string text;
  for (const auto& rule : analysis::rules()) {
    text += fmt::format("{:<4}{}\n", rule.id, rule.name);
  }
  return text;
}

std::string rule_page(const std::string& id) {
  std::string wanted = id;
  std::transform(wanted.begin(), wanted.end(), wanted.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  for (const auto& rule : analysis::rules()) {
    if (rule.id == wanted) {
      return fmt::format("{} {}\n\n{}\n", rule.id, rule.name, rule.page);
    }
  }
  throw UsageError(
      fmt::format("there is no rule \"{}\"; cie verify --list-rules names them all", id));
}

}  // namespace cie::cli
