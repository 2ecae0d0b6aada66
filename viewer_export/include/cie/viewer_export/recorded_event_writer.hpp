// `cie events`: the events of traces, or how many there are of each class.
#pragma once

#include <cie/analysis/recorded_events.hpp>

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

namespace cie::viewer_export {

enum class EventFormat : std::uint8_t { text, json, csv };

// Writes each event as it comes: a line of text or a JSON object per line, or a row of CSV whose
// context and fields are JSON. What traces call things never leaves its place.
class RecordedEventWriter {
 public:
  // Borrowed.
  RecordedEventWriter(std::ostream& out, EventFormat format);

  // Throws what the stream throws.
  void write(const analysis::RecordedEvent& event);

 private:
  void add_text(const analysis::RecordedEvent& event);
  void add_json(const analysis::RecordedEvent& event);
  void add_csv(const analysis::RecordedEvent& event);

  std::ostream& out_;
  EventFormat format_;
  std::string line_;
};

// Counts events by class.
class EventCounter {
 public:
  void add(const analysis::RecordedEvent& event) {
    if (event.event_class >= counts_.size()) counts_.resize(event.event_class + 1);
    auto& count = counts_[event.event_class];
    if (count.events++ == 0) count.name = event.name;
  }
  // Classes that occur, the most frequent first.
  void write(std::ostream& out, EventFormat format) const;

 private:
  struct Count {
    std::string name;
    std::uint64_t events = 0;
  };
  std::vector<Count> counts_;  // by class
};

}  // namespace cie::viewer_export
