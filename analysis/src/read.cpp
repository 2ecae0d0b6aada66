#include <cie/analysis/analyzer.hpp>

#include "ctf/native_reader.hpp"
#include "ctf/read_ahead.hpp"
#include "guard_state.hpp"
#include "reader/bt_reader.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"

#include <thread>

namespace cie::analysis {
namespace {

void read_natively(std::span<const std::filesystem::path> traces, const ctf::EventSink& sink,
                   const AnalysisOptions& options) {
  const bool has_two_cores = std::thread::hardware_concurrency() > 1;
  const auto& read = has_two_cores ? ctf::read_ahead : ctf::read_traces;
  read(traces, sink, options.metadata_from);
}

}  // namespace

AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  guard_tick();
  if (options.reader == Reader::babeltrace2) {
    bt::read_traces(traces, analyzer);
  } else {
    read_natively(
        traces, [&analyzer](const Event& event) { analyzer.consume(event); }, options);
  }
  guard_reading_ended();
  auto result = analyzer.finish();
  for (const auto& trace : traces)
    result.report.trace.paths.push_back(trace.string());
  return result;
}

std::optional<TimeWindow> recorded_window(std::span<const std::filesystem::path> traces,
                                          const AnalysisOptions& options) {
  std::optional<Timestamp> begin;
  std::optional<Timestamp> end;
  if (options.reader == Reader::babeltrace2) {
    auto all = options;
    all.window.reset();
    const auto summary = analyze(traces, all).report.trace;
    begin = summary.begin;
    end = summary.end;
  } else {
    Model model;
    Registry registry(model);
    RecordingTracker recording(model, registry);
    guard_tick();
    read_natively(
        traces,
        [&recording](const Event& event) {
          const auto apply = [&](const auto& e) { recording.apply(event.head, e); };
          std::visit(Overloaded{[&](const StreamBegin& e) { apply(e); },
                                [&](const StreamEnd& e) { apply(e); },
                                [&](const PacketBegin& e) { apply(e); },
                                [&](const PacketEnd& e) { apply(e); }, [](const auto&) {}},
                     event.body);
        },
        options);
    guard_reading_ended();
    recording.finish();
    begin = model.begin;
    end = model.end;
  }
  if (!begin || !end) return std::nullopt;
  return TimeWindow{.from = *begin, .to = *end};
}

}  // namespace cie::analysis
