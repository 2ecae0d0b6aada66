// What `cie --version` prints.
#pragma once

#include <string>
#include <string_view>

namespace cie::cli {

// The commit that was built, with "-dirty" where sources differed from it; empty: not out of git.
std::string_view built_commit() noexcept;

// The version on the first line; below it commit and compiler, and the libraries in use.
std::string version_text();

}  // namespace cie::cli
