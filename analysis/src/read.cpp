#include <cie/analysis/analyzer.hpp>

#include "ctf/native_reader.hpp"
#include "ctf/read_ahead.hpp"
#include "trackers/recording_tracker.hpp"
#include "trackers/registry.hpp"
#include "vocabulary/ros2/event_translator.hpp"

#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// `translator` may be null: whoever looks at packets alone does not need it.
void read_events(std::span<const std::filesystem::path> traces, const ctf::EventSink& sink,
                 const AnalysisOptions& options, EventTranslator* translator) {
  const bool has_two_cores = std::thread::hardware_concurrency() > 1;
  const auto& read = has_two_cores ? ctf::read_ahead : ctf::read_traces;
  read(traces, sink,
       {.metadata_from = options.metadata_from,
        .progress = options.progress,
        .translator = translator});
}

// Evidence names files below the trace, as the user named it where there are several: what is said
// of a recording does not depend on where it lies.
void shorten_files(std::span<const std::filesystem::path> traces, AnalysisResult& result) {
  std::vector<std::pair<std::string, std::string>> prefixes;  // and what stands for them
  for (const auto& trace : traces) {
    std::error_code error;
    auto whole = std::filesystem::canonical(trace, error).string() + '/';
    if (!error) prefixes.emplace_back(whole, traces.size() > 1 ? trace.string() + '/' : "");
  }
  const auto shorten = [&prefixes](std::string& file) {
    for (const auto& [whole, name] : prefixes) {
      for (auto at = file.find(whole); at != std::string::npos; at = file.find(whole, at)) {
        file.replace(at, whole.size(), name);
        at += name.size();
      }
    }
  };
  for (auto& defect : result.report.defects)
    shorten(defect.advice);
  for (auto& rule : result.verdicts.rules) {
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
  analyzer.add(find_recordings(traces, options.is_content_checked));
  EventTranslator translator;
  read_events(
      traces, [&analyzer](const Event& event) { analyzer.consume(event); }, options, &translator);
  auto result = analyzer.finish();
  for (const auto& trace : traces)
    result.report.trace.paths.push_back(trace.string());
  shorten_files(traces, result);
  return result;
}

std::optional<TimeWindow> recorded_window(std::span<const std::filesystem::path> traces,
                                          const AnalysisOptions& options) {
  Model model;
  Registry registry(model);
  RecordingTracker recording(model, registry);
  read_events(
      traces,
      [&recording](const Event& event) {
        const auto apply = [&](const auto& e) { recording.apply(event.head, e); };
        std::visit(Overloaded{[&](const StreamBegin& e) { apply(e); },
                              [&](const StreamEnd& e) { apply(e); },
                              [&](const PacketBegin& e) { apply(e); },
                              [&](const PacketEnd& e) { apply(e); }, [](const auto&) {}},
                   event.body);
      },
      options, nullptr);
  recording.finish();
  if (!model.begin || !model.end) return std::nullopt;
  return TimeWindow{.from = *model.begin, .to = *model.end};
}

}  // namespace cie::analysis
