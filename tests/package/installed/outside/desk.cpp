// Feeds the analyzer two instances by hand and prints its report.
#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include <iostream>
#include <sstream>

namespace {

cie::analysis::Event at(std::int64_t ns, cie::analysis::EventBody body) {
  return {.head = {.time = {ns}, .stream = {}, .cpu = 0, .pid = 7, .tid = 8}, .body = body};
}

}  // namespace

int main() {
  using namespace cie::analysis;
  const cie::CallbackId id{3};
  Analyzer analyzer(AnalysisOptions{});
  analyzer.consume(at(0, StreamBegin{}));
  analyzer.consume(at(0, PacketBegin{}));
  for (std::uint64_t seq = 0; seq < 2; ++seq) {
    const auto start = static_cast<std::int64_t>(100 * (seq + 1));
    CallbackStart started;
    started.callback = id;
    started.seq = seq;
    analyzer.consume(at(start, started));
    analyzer.consume(at(start + 30, CallbackEnd{.callback = id, .seq = seq, .status = {}}));
  }
  analyzer.consume(at(500, PacketEnd{}));
  analyzer.consume(at(500, StreamEnd{}));
  const auto report = analyzer.finish().report;
  std::ostringstream json;
  cie::viewer_export::write_report_json(json, report);
  std::cout << json.str();
  const bool is_right = report.callbacks.size() == 1 && report.callbacks[0].instances == 2 &&
                        report.callbacks[0].duration->sum == 60;
  return is_right ? 0 : 1;
}
