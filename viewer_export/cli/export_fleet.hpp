// `cie export --to clickhouse`, `--to parquet --partition`: a recording among those of many
// machines.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "progress_bar.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace cie::cli {

struct FleetRequest {
  std::vector<std::string> labels;  // NAME=VALUE
  bool is_partitioned = false;      // Parquet files; else for ClickHouse
};

// Throws UnreadableTrace, WriteError, UsageError.
int export_fleet(const std::vector<std::filesystem::path>& traces,
                 analysis::AnalysisOptions options, ProgressBar& bar, const FleetRequest& request,
                 const std::string& directory);

}  // namespace cie::cli
