// The rules' documentation, as `cie verify --list-rules` and `--explain` print it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace cie::cli {

// One line per rule: id and name.
std::string rule_list();
// The id as the rule has it; its case does not matter. Throws UsageError, naming `option`, for what
// is no rule.
std::string known_rule(std::string_view option, const std::string& id);
// The page of one rule, that wide at most; the id's case does not matter. Throws UsageError for an
// unknown id.
std::string rule_page(const std::string& id, std::size_t columns);

}  // namespace cie::cli
