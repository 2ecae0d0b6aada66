// `cie export --to` of a viewer: a recording for somebody's viewer.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "export_formats.hpp"
#include "progress_bar.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace cie::cli {

struct ViewerRequest {
  ExportFormat format;
  std::string target;
  bool is_compressed = false;
};

// Throws UnreadableTrace, WriteError, UsageError.
int export_to_viewer(const std::vector<std::filesystem::path>& traces,
                     const analysis::AnalysisOptions& options, ProgressBar& bar,
                     const ViewerRequest& request);

}  // namespace cie::cli
