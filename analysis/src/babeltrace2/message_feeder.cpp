#include <cie/analysis/message_feeder.hpp>

#include "bt_handles.hpp"
#include "message_decoder.hpp"

#include <cstddef>
#include <deque>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace cie::analysis {
namespace {

using Foretold = bt::MessageDecoder::Foretold;

// An idle CPU's stream begins when all is over, so the first messages are held back until it is known
// which streams have events. Enough for all streams of a recording that begins at once; a few tens
// of megabytes in libbabeltrace2.
constexpr std::size_t kMostHeld = 16'384;

bt::Message share(const bt_message* message) {
  bt_message_get_ref(message);
  return bt::Message(message);
}

}  // namespace

struct MessageFeeder::Decoder {
  explicit Decoder(Analyzer& analyzer) : input(analyzer) {}

  void consume(const bt_message* message) {
    if (!is_holding_) {
      pass_on(message);
      return;
    }
    held_.push_back(share(message));
    note(message);
    if ((!streams_.empty() && silent_ == 0) || held_.size() >= kMostHeld) release();
  }
  void release() {
    is_holding_ = false;
    for (auto& message : std::exchange(held_, {})) {
      pass_on(message.get());
      message.reset();
    }
    streams_.clear();
    begun_.clear();
  }

  bt::AnalyzerInput input;
  bt::MessageDecoder messages{input};

 private:
  void note(const bt_message* message) {
    switch (bt_message_get_type(message)) {
      case BT_MESSAGE_TYPE_STREAM_BEGINNING:
        if (streams_
                .try_emplace(bt_message_stream_beginning_borrow_stream_const(message),
                             Foretold::silence)
                .second) {
          ++silent_;
        }
        break;
      case BT_MESSAGE_TYPE_PACKET_BEGINNING:
        begun_.insert(bt_packet_borrow_stream_const(
            bt_message_packet_beginning_borrow_packet_const(message)));
        break;
      case BT_MESSAGE_TYPE_EVENT:
        decide(bt_event_borrow_stream_const(bt_message_event_borrow_event_const(message)),
               Foretold::events);
        break;
      case BT_MESSAGE_TYPE_STREAM_END:
        decide(bt_message_stream_end_borrow_stream_const(message), Foretold::nothing);
        break;
      default:
        break;
    }
  }
  void decide(const bt_stream* stream, Foretold what) {
    const auto found = streams_.find(stream);
    if (found == streams_.end() || found->second != Foretold::silence) return;
    found->second = what;
    --silent_;
  }
  // What begins early was made with the others, and is no idle one's: its events come later.
  Foretold foretold(const bt_stream* stream) const {
    const auto found = streams_.find(stream);
    if (found == streams_.end()) return Foretold::silence;
    const bool is_early = found->second == Foretold::silence && begun_.contains(stream);
    return is_early ? Foretold::events : found->second;
  }
  void pass_on(const bt_message* message) {
    if (bt_message_get_type(message) == BT_MESSAGE_TYPE_STREAM_BEGINNING) {
      const auto* stream = bt_message_stream_beginning_borrow_stream_const(message);
      messages.foretell(stream, foretold(stream));
    }
    messages.consume(message);
  }

  bool is_holding_ = true;
  std::deque<bt::Message> held_;
  std::unordered_map<const bt_stream*, Foretold> streams_;  // that began among them
  std::unordered_set<const bt_stream*> begun_;              // of them, by a packet
  std::size_t silent_ = 0;                                  // of them, as far as known
};

MessageFeeder::MessageFeeder(Analyzer& analyzer) : decoder_(std::make_unique<Decoder>(analyzer)) {}
MessageFeeder::~MessageFeeder() = default;

void MessageFeeder::consume(const bt_message* message) { decoder_->consume(message); }
void MessageFeeder::finish() {
  decoder_->release();
  decoder_->input.finish();
}

}  // namespace cie::analysis
