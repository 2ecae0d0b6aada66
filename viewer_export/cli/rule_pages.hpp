// The rules' documentation, as `cie verify --list-rules` and `--explain` print it.
#pragma once

#include <string>

namespace cie::cli {

// One line per rule: id and name.
std::string rule_list();
// The page of one rule; the id's case does not matter. Throws UsageError for an unknown id.
std::string rule_page(const std::string& id);

}  // namespace cie::cli
