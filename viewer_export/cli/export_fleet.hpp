// `cie export --to parquet --partition`: a recording among those of many machines.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "progress_bar.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace cie::cli {

// `labels`: NAME=VALUE. Throws UnreadableTrace, WriteError, UsageError.
int export_fleet(const std::vector<std::filesystem::path>& traces,
                 analysis::AnalysisOptions options, ProgressBar& bar,
                 const std::vector<std::string>& labels, const std::string& directory);

}  // namespace cie::cli
