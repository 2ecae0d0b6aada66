// What all decoders that feed one analyzer share: numbers that are given once, and the stage that
// translates what has a meaning only together with earlier events, of whichever decoder.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/event.hpp>

#include "vocabulary/event_batch.hpp"
#include "vocabulary/ros2/event_translator.hpp"
#include "vocabulary/vocabulary.hpp"

#include <cstdint>

namespace cie::analysis::bt {

class AnalyzerInput {
 public:
  // `analyzer` is borrowed.
  explicit AnalyzerInput(Analyzer& analyzer) : analyzer_(analyzer) {}

  StreamIndex next_stream() noexcept { return StreamIndex{streams_++}; }
  std::uint32_t next_channel() noexcept { return channels_++; }
  std::uint32_t next_trace() noexcept { return traces_++; }

  void push(const EventHead& head, const EventBody& body) {
    auto& event = begin(head);
    event.body = body;
    batch_.keep(event);
    pass_on();
  }
  void push(const EventHead& head, const Translation& translation, const Payload& payload,
            VocabularyState& state) {
    translate(begin(head), translation, payload, state, batch_, &translator_);
    pass_on();
  }
  // Nothing follows: tells the analyzer what was still to be told.
  void finish() {
    batch_.clear();
    translator_.finish(batch_);
    analyzer_.consume(batch_);
  }

 private:
  Event& begin(const EventHead& head) {
    batch_.clear();
    auto& event = batch_.add();
    event.head = head;
    return event;
  }
  void pass_on() {
    translator_.observe(batch_);
    analyzer_.consume(batch_);
  }

  Analyzer& analyzer_;
  std::uint32_t streams_ = 0;
  std::uint32_t channels_ = 0;
  std::uint32_t traces_ = 0;
  EventTranslator translator_;
  EventBatch batch_{1};
};

}  // namespace cie::analysis::bt
