#include <cie/analysis/analyzer.hpp>

#include "ctf/native_reader.hpp"
#include "ctf/read_ahead.hpp"
#include "guard_state.hpp"
#include "reader/bt_reader.hpp"

#include <thread>

namespace cie::analysis {

AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  guard_tick();
  if (options.reader == Reader::babeltrace2) {
    bt::read_traces(traces, analyzer);
  } else {
    const bool has_two_cores = std::thread::hardware_concurrency() > 1;
    const auto& read = has_two_cores ? ctf::read_ahead : ctf::read_traces;
    read(
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
