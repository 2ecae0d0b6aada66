// For graphs of babeltrace2 that somebody else runs: feeds their messages to an Analyzer.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include <memory>

extern "C" {
struct bt_message;  // libbabeltrace2's
}

namespace cie::analysis {

// Messages must come merged by time (flt.utils.muxer). Not thread-safe. `analyzer` is borrowed.
class MessageFeeder {
 public:
  explicit MessageFeeder(Analyzer& analyzer);
  ~MessageFeeder();
  MessageFeeder(const MessageFeeder&) = delete;
  MessageFeeder& operator=(const MessageFeeder&) = delete;

  // Shares `message`, if need be: the analyzer is fed once it is known which streams have events, or
  // at last by finish(). Messages that are no events or packets are ignored.
  void consume(const bt_message* message);
  // Before the analyzer's: feeds it what follows from all messages.
  void finish();

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace cie::analysis
