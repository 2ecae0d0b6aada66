// What the subcommands read: traces through the analyzer, and a scheduling spec.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::cli {

// Empty for an empty name. Throws SpecError.
std::optional<SchedulingSpec> load_spec(const std::string& file);

// analysis::analyze with a count of instances on standard error while it goes, if that is a
// terminal. Throws UnreadableTrace.
analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               const analysis::AnalysisOptions& options,
                                               analysis::Observer* observer = nullptr);

}  // namespace cie::cli
