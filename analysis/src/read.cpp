#include <cie/analysis/analyzer.hpp>

#include "ctf/native_reader.hpp"
#include "guard_state.hpp"
#include "reader/bt_reader.hpp"

namespace cie::analysis {

AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  guard_tick();
  if (options.reader == Reader::babeltrace2) {
    bt::read_traces(traces, analyzer);
  } else {
    ctf::read_traces(
        traces, [&analyzer](const Event& event) { analyzer.consume(event); },
        options.metadata_from);
  }
  guard_reading_ended();
  auto result = analyzer.finish();
  for (const auto& trace : traces)
    result.report.trace.paths.push_back(trace.string());
  return result;
}

}  // namespace cie::analysis
