// What the subcommands read: traces through the analyzer, and a scheduling spec.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "command_line.hpp"
#include "progress_bar.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cie::cli {

// Empty for an empty name. Throws SpecError.
std::optional<SchedulingSpec> load_spec(const std::string& file);

// "--metadata FILE" and "--quiet" of every command that reads traces.
class ReaderOption {
 public:
  // Adds it to `line`, which reads into this object when it parses.
  explicit ReaderOption(CommandLine& line,
                        const std::string& quiet = "No progress on the terminal");
  ReaderOption(const ReaderOption&) = delete;
  ReaderOption& operator=(const ReaderOption&) = delete;

  // After parsing: file of "--metadata"; empty if it was not given.
  std::filesystem::path metadata() const { return metadata_; }
  // The options as they were given, for a command line that reads likewise.
  Arguments arguments() const;
  bool is_quiet() const noexcept { return is_quiet_; }
  // Whether progress may be shown.
  bool is_progress_wanted() const noexcept { return !is_quiet_; }

 private:
  std::string metadata_;
  bool is_quiet_ = false;
};

// What follows a command that is printed for pasting, so that it reads the same as this one: traces
// and options, quoted for a shell. `window`: as the option's text.
std::string input_arguments(const std::vector<std::filesystem::path>& traces,
                            const ReaderOption& reader, const std::string& spec,
                            const std::string& window = {});
// Words of a command line for a shell, quoted where they need it.
std::string shell_words(const Arguments& arguments);

// analysis::analyze, while `bar` shows how much is read. Throws UnreadableTrace.
analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               const analysis::AnalysisOptions& options,
                                               ProgressBar& bar,
                                               analysis::Observer* observer = nullptr);
// The same for a command whose process ends soon: the result, and what it was made from, stay until
// then, since to destroy them piece by piece takes longer than to end a process that has them.
analysis::AnalysisResult& analyze_until_exit(const std::vector<std::filesystem::path>& traces,
                                             const analysis::AnalysisOptions& options,
                                             ProgressBar& bar,
                                             analysis::Observer* observer = nullptr);

// Says on standard error what the recording lacks, for output that has no place for it.
void tell_of_damage(const analysis::Report& report);

}  // namespace cie::cli
