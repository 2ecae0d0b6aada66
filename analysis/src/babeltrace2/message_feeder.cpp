#include <cie/analysis/message_feeder.hpp>

#include "message_decoder.hpp"

namespace cie::analysis {

struct MessageFeeder::Decoder {
  explicit Decoder(Analyzer& analyzer) : input(analyzer) {}
  bt::AnalyzerInput input;
  bt::MessageDecoder messages{input};
};

MessageFeeder::MessageFeeder(Analyzer& analyzer) : decoder_(std::make_unique<Decoder>(analyzer)) {}
MessageFeeder::~MessageFeeder() = default;

void MessageFeeder::consume(const bt_message* message) { decoder_->messages.consume(message); }
void MessageFeeder::finish() { decoder_->input.finish(); }

}  // namespace cie::analysis
