#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/namespaced_pid.hpp>
#include <cie/analysis/recorded_events.hpp>

#include "ctf/native_reader.hpp"
#include "ctf/read_ahead.hpp"
#include "model/clock_differences.hpp"
#include "pipeline.hpp"
#include "trackers/recording_tracker.hpp"
#include "trackers/registry.hpp"
#include "vocabulary/ros2/event_translator.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// For a `sink` that has work of its own to do: to count an event costs less than to pass it on to
// another core.
void read_for(const ctf::BatchSink& sink, std::span<const std::filesystem::path> traces,
              const ctf::ReadOptions& options) {
  // Below that an answer most often takes a fifth of a second at most. Another core saves a third of
  // it, and costs up to a sixth more CPU time.
  constexpr std::uint64_t kWorthAnotherCore = std::uint64_t{48} << 20U;
  ctf::TraceReader reader(traces, options);
  if (reader.bytes() >= kWorthAnotherCore && std::thread::hardware_concurrency() > 1) {
    ctf::read_ahead(reader, sink);
  } else {
    reader.read(sink);
  }
}

bool is_in(const std::optional<TimeWindow>& window, Timestamp begin, Timestamp end) {
  return !window || (begin <= window->to && end >= window->from);
}

// Passes on what was asked for, and counts what is missing.
class RecordedEvents {
 public:
  RecordedEvents(const ctf::EventChoice& choice, const std::optional<TimeWindow>& window,
                 const RecordedEventSink& sink)
      : choice_(choice), window_(window), sink_(sink) {}

  void consume(const Event& event) {
    std::visit(Overloaded{[&](const OtherEvent& e) { pass_on(event.head, e); },
                          [&](const StreamBegin& e) {
                            const auto stream = static_cast<std::size_t>(event.head.stream);
                            if (hosts_.size() <= stream) hosts_.resize(stream + 1);
                            hosts_[stream] = e.host;
                            missing_.malformed += e.malformed_classes;
                            if (missing_.why_malformed.empty())
                              missing_.why_malformed = e.malformed;
                            if (window_) require_one_clock(event.head, e);
                          },
                          [&](const Discarded& e) {
                            if (!is_in(window_, e.begin, e.end)) return;
                            (e.packets ? missing_.packets : missing_.events) += e.count.value_or(1);
                          },
                          [&](const DamagedPacket& e) {
                            const auto time = event.head.time;
                            if (!is_in(window_, e.begin.value_or(time), e.end.value_or(time)))
                              return;
                            ++(e.has_foreign_metadata ? missing_.foreign : missing_.damaged);
                          },
                          [](const auto&) {}},
               event.body);
  }
  const MissingEvents& missing() const noexcept { return missing_; }

 private:
  void require_one_clock(const EventHead& head, const StreamBegin& event) {
    recording_.apply(head, event);
    analysis::require_one_clock(model_);
  }
  void pass_on(const EventHead& head, const OtherEvent& event) {
    if (event.event_class == OtherEvent::kNoClass || !is_in(window_, head.time, head.time)) return;
    sink_({.time = head.time,
           .host = hosts_[static_cast<std::size_t>(head.stream)],
           .cpu = head.cpu,
           .pid = head.pid ? std::optional(plain_pid(*head.pid)) : std::nullopt,
           .tid = head.tid,
           .event_class = event.event_class,
           .name = choice_.names()[event.event_class],
           .context = event.fields.first(event.context),
           .fields = event.fields.subspan(event.context)});
  }

  const ctf::EventChoice& choice_;
  const std::optional<TimeWindow>& window_;
  const RecordedEventSink& sink_;
  std::vector<std::string> hosts_;  // by stream
  MissingEvents missing_;
  Model model_;  // of hosts and streams alone
  Registry registry_{model_};
  RecordingTracker recording_{model_, registry_};
};

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
      for (auto& evidence : subject.evidence) {
        shorten(evidence.file);
        for_each_argument(evidence.note, [&](Argument& argument) {
          if (auto* named = std::get_if<NamedFile>(&argument.value)) shorten(named->path);
          if (auto* text = std::get_if<std::string>(&argument.value)) shorten(*text);
        });
      }
    }
  }
}

}  // namespace

AnalysisResult analyze(std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options, Observer* observer) {
  Analyzer analyzer(options, observer);
  return analyze(analyzer, traces, options);
}

AnalysisResult analyze(Analyzer& analyzer, std::span<const std::filesystem::path> traces,
                       const AnalysisOptions& options) {
  auto recordings = find_recordings(traces, options.is_content_checked);
  analyzer.add(recordings);
  auto& translator = analyzer.pipeline_->translator;
  translator = std::make_unique<EventTranslator>(std::move(recordings));
  read_for([&analyzer](const EventBatch& batch) { analyzer.consume(batch); }, traces,
           {.metadata_from = options.metadata_from,
            .progress = options.progress,
            .translator = translator.get(),
            .counts_others = !options.window});  // else those inside are
  auto result = analyzer.finish();
  for (const auto& trace : traces)
    result.report.trace.paths.push_back(trace.string());
  shorten_files(traces, result);
  return result;
}

MissingEvents read_recorded_events(std::span<const std::filesystem::path> traces,
                                   const RecordedEventOptions& options,
                                   const RecordedEventSink& sink) {
  ctf::EventChoice choice(options.wants, options.has_fields);
  RecordedEvents events(choice, options.window, sink);
  const auto consume = [&events](const Event& event) { events.consume(event); };
  const ctf::ReadOptions reading{.metadata_from = options.metadata_from,
                                 .progress = options.progress,
                                 .choice = &choice,
                                 .window = options.window.value_or(TimeWindow{}),
                                 .counts_others = true};
  if (options.has_fields) {
    read_for([&consume](const EventBatch& batch) { batch.each(consume); }, traces, reading);
  } else {
    ctf::read_traces(traces, consume, reading);
  }
  return events.missing();
}

std::optional<TimeWindow> recorded_window(std::span<const std::filesystem::path> traces,
                                          const AnalysisOptions& options) {
  Model model;
  model.recordings = find_recordings(traces, /*is_content_checked=*/false);
  Registry registry(model);
  RecordingTracker recording(model, registry);
  ctf::read_traces(
      traces,
      [&recording](const Event& event) {
        const auto apply = [&](const auto& e) { recording.apply(event.head, e); };
        const auto note_run = [&] { recording.note_run(event.head.stream, event.head.time); };
        std::visit(Overloaded{[&](const StreamBegin& e) { apply(e); },
                              [&](const StreamEnd& e) { apply(e); },
                              [&](const PacketBegin& e) { apply(e); },
                              [&](const PacketEnd& e) { apply(e); },
                              [&](const CallbackStart&) { note_run(); },
                              [&](const CallbackEnd&) { note_run(); }, [](const auto&) {}},
                   event.body);
      },
      {.metadata_from = options.metadata_from,
       .progress = options.progress,
       .counts_others = true});
  recording.finish();
  require_one_clock(model);
  if (!model.begin || !model.end) return std::nullopt;
  return TimeWindow{.from = *model.begin, .to = *model.end};
}

}  // namespace cie::analysis
