#include <cie/analysis/analyzer.hpp>

#include "ctf/native_reader.hpp"
#include "ctf/read_ahead.hpp"
#include "guard_state.hpp"
#include "reader/bt_reader.hpp"
#include "recording_tracker.hpp"
#include "registry.hpp"

#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

void read_natively(std::span<const std::filesystem::path> traces, const ctf::EventSink& sink,
                   const AnalysisOptions& options) {
  const bool has_two_cores = std::thread::hardware_concurrency() > 1;
  const auto& read = has_two_cores ? ctf::read_ahead : ctf::read_traces;
  read(traces, sink, {.metadata_from = options.metadata_from, .progress = options.progress});
}

// Evidence names files below the trace, as the user named it where there are several: what is said
// of a recording does not depend on where it lies.
void shorten_files(std::span<const std::filesystem::path> traces, VerdictReport& verdicts) {
  std::vector<std::pair<std::string, std::string>> prefixes;  // and what stands for them
  for (const auto& trace : traces) {
    std::error_code error;
    auto whole = std::filesystem::canonical(trace, error).string() + '/';
    if (!error) prefixes.emplace_back(whole, traces.size() > 1 ? trace.string() + '/' : "");
  }
  const auto shorten = [&prefixes](std::string& file) {
    for (const auto& [whole, name] : prefixes) {
      if (file.starts_with(whole)) file.replace(0, whole.size(), name);
    }
  };
  for (auto& rule : verdicts.rules) {
    for (auto& subject : rule.subjects) {
      for (auto& evidence : subject.evidence)
        shorten(evidence.file);
    }
  }
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
  shorten_files(traces, result.verdicts);
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
