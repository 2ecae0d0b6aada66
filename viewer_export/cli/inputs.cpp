#include "inputs.hpp"

#include <cie/tracepoints/recording_manifest.hpp>

#include "base/messages.hpp"
#include "base/text.hpp"
#include "output.hpp"
#include "words/recording_words.hpp"
#include "words/text_layout.hpp"

#include <memory>
#include <system_error>
#include <utility>

namespace cie::cli {
namespace {

// Destroyed by nobody, and referred to, so that it is no leak.
template <typename T>
T& keep_until_exit(T object) {
  static auto& kept = *new std::vector<std::unique_ptr<T>>();
  return *kept.emplace_back(std::make_unique<T>(std::move(object)));
}

// What is said of such recordings ("interrupted", "not complete") is so only as yet.
void tell_of_recorders(const std::vector<std::filesystem::path>& traces) {
  for (const auto& trace : traces) {
    std::error_code ignored;
    if (std::filesystem::exists(trace / kRecordingClaimName, ignored)) {
      tell(
          trace.string() +
          " is still being recorded, or its recorder was killed or its directory moved: what follows "
          "is of what was written so far");
    }
  }
}

analysis::AnalysisResult analyze(analysis::Analyzer& analyzer,
                                 const std::vector<std::filesystem::path>& traces,
                                 analysis::AnalysisOptions options, ProgressBar& bar) {
  tell_of_recorders(traces);
  options.progress = bar.begin("reading", ProgressUnit::bytes);
  auto result = analysis::analyze(analyzer, traces, options);
  bar.end();
  return result;
}

}  // namespace

ReaderOption::ReaderOption(CommandLine& line, const std::string& quiet) {
  line.option("--metadata", "FILE", metadata_,
              "Metadata of a like recording, for traces whose own is lost");
  line.flag("-q,--quiet", is_quiet_, quiet);
}

Arguments ReaderOption::arguments() const {
  Arguments arguments;
  if (!metadata_.empty()) arguments.insert(arguments.end(), {"--metadata", metadata_});
  return arguments;
}

void tell_of_damage(const analysis::Report& report) {
  const auto damages = viewer_export::damages_of(report, "...");
  for (const auto& damage : damages)
    tell(damage);
  if (damages.empty() && viewer_export::is_complete(report) == false)
    tell("the recording is NOT complete: see rules T2 to T4 of cie verify");
  if (report.callbacks.empty()) tell(viewer_export::no_callback_seen(report));
}

std::string input_arguments(const std::vector<std::filesystem::path>& traces,
                            const ReaderOption& reader, const std::string& spec,
                            const std::string& window) {
  Arguments arguments;
  for (const auto& trace : traces)
    arguments.push_back(trace.string());
  if (!spec.empty()) arguments.insert(arguments.end(), {"--spec", spec});
  if (!window.empty()) arguments.push_back("--window=" + window);  // it may begin with a dash
  const auto of_reader = reader.arguments();
  arguments.insert(arguments.end(), of_reader.begin(), of_reader.end());
  return shell_words(arguments);
}

std::string shell_words(const Arguments& arguments) {
  std::string text;
  for (const auto& argument : arguments)
    text += (text.empty() ? "" : " ") + shell_quoted(argument);
  return text;
}

std::optional<SchedulingSpec> load_spec(const std::string& file) {
  return file.empty() ? std::nullopt : std::optional(SchedulingSpec::load(file));
}

analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               const analysis::AnalysisOptions& options,
                                               ProgressBar& bar, analysis::Observer* observer) {
  analysis::Analyzer analyzer(options, observer);
  return analyze(analyzer, traces, options, bar);
}

analysis::AnalysisResult& analyze_until_exit(const std::vector<std::filesystem::path>& traces,
                                             const analysis::AnalysisOptions& options,
                                             ProgressBar& bar, analysis::Observer* observer) {
  auto& analyzer = keep_until_exit(analysis::Analyzer(options, observer));
  return keep_until_exit(analyze(analyzer, traces, options, bar));
}

}  // namespace cie::cli
