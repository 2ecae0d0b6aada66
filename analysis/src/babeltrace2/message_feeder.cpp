#include <cie/analysis/message_feeder.hpp>

#include "message_decoder.hpp"

namespace cie::analysis {

struct MessageFeeder::Decoder {
  explicit Decoder(Analyzer& analyzer) : messages(analyzer) {}
  bt::MessageDecoder messages;
};

MessageFeeder::MessageFeeder(Analyzer& analyzer) : decoder_(std::make_unique<Decoder>(analyzer)) {}
MessageFeeder::~MessageFeeder() = default;

void MessageFeeder::consume(const bt_message* message) { decoder_->messages.consume(message); }

}  // namespace cie::analysis
