// Reports that were written as JSON, read again.
#pragma once

#include <cie/analysis/comparison.hpp>

#include <filesystem>
#include <vector>

namespace cie::cli {

// The callbacks of a `cie.report/2`, or of its version 1. Throws analysis::UnreadableTrace, naming
// the file and what is wrong with it.
std::vector<analysis::CallbackSample> samples_in_report(const std::filesystem::path& file);

}  // namespace cie::cli
