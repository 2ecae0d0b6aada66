// The events of traces themselves, of every class, with the fields that the traces declare.
#pragma once

#include <cie/analysis/other_event.hpp>
#include <cie/analysis/progress.hpp>
#include <cie/analysis/time.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string_view>

namespace cie::analysis {

// Views are valid during the call that passes it on; the name for as long as the traces are read.
struct RecordedEvent {
  Timestamp time;
  std::string_view host;
  std::optional<std::int32_t> cpu{};
  std::optional<std::int64_t> pid{};
  std::optional<std::int64_t> tid{};
  std::uint32_t event_class = 0;  // dense: classes of one name have one number
  std::string_view name;
  std::span<const FieldValue> context{};  // what the tracer adds to events
  std::span<const FieldValue> fields{};
};
using RecordedEventSink = std::function<void(const RecordedEvent&)>;

struct RecordedEventOptions {
  // Asked once of each name of a class; fields of the others are not read.
  std::function<bool(std::string_view name)> wants;
  bool has_fields = true;  // otherwise context and fields are empty
  std::optional<TimeWindow> window{};
  std::filesystem::path metadata_from{};  // these two: as in AnalysisOptions
  Progress* progress = nullptr;
};

// What is not among the events that were passed on.
struct MissingEvents {
  std::uint64_t events = 0;     // thrown away by the tracer
  std::uint64_t packets = 0;    // the same
  std::uint64_t damaged = 0;    // places of files that cannot be read
  std::uint64_t foreign = 0;    // nothing is missing, but others' metadata were used
  std::uint64_t malformed = 0;  // classes of events that cannot be understood
  std::string why_malformed{};  // the first one
  friend bool operator==(const MissingEvents&, const MissingEvents&) = default;
};

// Reads the traces (as analyze() does) and passes on their events, merged by time. Throws
// UnreadableTrace, SeveralClocks (analyzer.hpp) and what `sink` throws.
MissingEvents read_recorded_events(std::span<const std::filesystem::path> traces,
                                   const RecordedEventOptions& options,
                                   const RecordedEventSink& sink);

}  // namespace cie::analysis
