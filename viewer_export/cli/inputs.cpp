#include "inputs.hpp"

namespace cie::cli {
ReaderOption::ReaderOption(CommandLine& line) {
  line.option("--reader", "READER", choice_,
              "Who decodes the traces: native (default) or babeltrace2 (CTF 1.8 only)");
  line.option("--metadata", "FILE", metadata_,
              "Metadata of a like recording, for traces whose own is lost");
  line.flag("-q,--quiet", is_quiet_, "No progress on the terminal");
}

analysis::Reader ReaderOption::value() const {
  check_choice("--reader", choice_, {"native", "babeltrace2"});
  if (choice_ != "native" && !metadata_.empty()) {
    throw UsageError("--metadata is for the native reader");
  }
  return choice_ == "native" ? analysis::Reader::native : analysis::Reader::babeltrace2;
}

std::optional<SchedulingSpec> load_spec(const std::string& file) {
  return file.empty() ? std::nullopt : std::optional(SchedulingSpec::load(file));
}

analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               analysis::AnalysisOptions options, ProgressBar& bar,
                                               analysis::Observer* observer) {
  options.progress = bar.begin("reading", ProgressUnit::bytes);
  auto result = analysis::analyze(traces, options, observer);
  bar.end();
  return result;
}

}  // namespace cie::cli
