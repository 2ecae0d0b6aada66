#include "rule_pages.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "command_line.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

namespace cie::cli {
namespace {

// Paragraph by paragraph.
std::string wrapped(std::string_view page, std::size_t columns) {
  std::string text;
  while (!page.empty()) {
    const auto end = std::min(page.find('\n'), page.size());
    const auto lines = viewer_export::wrap(page.substr(0, end), columns);
    for (const auto& line : lines) {
      text += line + '\n';
    }
    text += page.size() > end ? "\n" : "";
    page.remove_prefix(std::min(end + 1, page.size()));
  }
  return text;
}

}  // namespace

std::string rule_list() {
  std::string text;
  for (const auto& rule : analysis::rule_pages()) {
    text += fmt::format("{:<4}{}\n", rule.id, rule.name);
  }
  return text;
}

std::string known_rule(std::string_view option, const std::string& id) {
  auto wanted = analysis::as_rule_id(id);
  if (analysis::find_rule_page(wanted) != nullptr) return wanted;
  throw UsageError(fmt::format(
      "{}: there is no rule \"{}\"; cie verify --list-rules names them all", option, id));
}

std::string rule_page(const std::string& id, std::size_t columns) {
  const auto wanted = known_rule("--explain", id);
  const auto* rule = analysis::find_rule_page(wanted);
  return fmt::format("{} {}\n\n{}", rule->id, rule->name, wrapped(rule->page, columns));
}

}  // namespace cie::cli
