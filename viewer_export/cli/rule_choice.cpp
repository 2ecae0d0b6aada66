#include "rule_choice.hpp"

#include <cie/analysis/rule_pages.hpp>

#include "command_line.hpp"
#include "rule_pages.hpp"

#include <algorithm>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::cli {
namespace {

std::vector<std::string> ids_in(std::string_view option, std::string_view list) {
  std::vector<std::string> ids;
  while (!list.empty()) {
    const auto end = std::min(list.find(','), list.size());
    ids.push_back(known_rule(option, std::string(list.substr(0, end))));
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return ids;
}

}  // namespace

RuleChoice::RuleChoice(const std::string& only, const std::string& skip)
    : only_(ids_in("--only", only)), skip_(ids_in("--skip", skip)) {
  if (!only_.empty() && !skip_.empty()) {
    throw UsageError(
        "--only and --skip exclude each other: name the rules that count, or those "
        "that do not");
  }
  const auto& pages = analysis::rule_pages();
  if (std::ranges::none_of(pages,
                           [this](const auto& rule) { return is_chosen(std::string(rule.id)); }))
    throw UsageError("--skip leaves no rule: nothing would be checked");
}

bool RuleChoice::is_chosen(const std::string& id) const {
  const auto holds = [&id](const auto& ids) { return std::ranges::find(ids, id) != ids.end(); };
  return only_.empty() ? !holds(skip_) : holds(only_);
}

void RuleChoice::apply(analysis::VerdictReport& verdicts) const {
  std::erase_if(verdicts.rules, [this](const auto& rule) { return !is_chosen(rule.id); });
  verdicts.verdict = analysis::overall_verdict(verdicts);
}

}  // namespace cie::cli
