// Reports that were written as JSON, read again.
#pragma once

#include <cie/analysis/comparison.hpp>

#include <filesystem>

namespace cie::cli {

// What a `cie.report/2`, or its version 1, tells of a recording. Throws analysis::UnreadableTrace, naming
// the file and what is wrong with it.
analysis::ComparedSide side_in_report(const std::filesystem::path& file);

}  // namespace cie::cli
