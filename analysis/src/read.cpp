#include <cie/analysis/analyzer.hpp>

#include "guard_state.hpp"
#include "reader/bt_reader.hpp"

namespace cie::analysis {

AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  guard_tick();
  bt::read_traces(traces, analyzer);
  guard_reading_ended();
  auto result = analyzer.finish();
  for (const auto& trace : traces)
    result.report.trace.paths.push_back(trace.string());
  return result;
}

}  // namespace cie::analysis
