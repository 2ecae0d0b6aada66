// What the subcommands read: traces through the analyzer, and a scheduling spec.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "command_line.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::cli {

// Empty for an empty name. Throws SpecError.
std::optional<SchedulingSpec> load_spec(const std::string& file);

// "--reader native|babeltrace2" and "--metadata FILE" of every command that reads traces.
class ReaderOption {
 public:
  // Adds it to `line`, which reads into this object when it parses.
  explicit ReaderOption(CommandLine& line);
  ReaderOption(const ReaderOption&) = delete;
  ReaderOption& operator=(const ReaderOption&) = delete;

  // After parsing. Throws UsageError.
  analysis::Reader value() const;
  // File of "--metadata"; empty if it was not given.
  std::filesystem::path metadata() const { return metadata_; }

 private:
  std::string choice_ = "native";
  std::string metadata_;
};

// analysis::analyze with a count of instances on standard error while it goes, if that is a
// terminal. Throws UnreadableTrace.
analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               const analysis::AnalysisOptions& options,
                                               analysis::Observer* observer = nullptr);

}  // namespace cie::cli
