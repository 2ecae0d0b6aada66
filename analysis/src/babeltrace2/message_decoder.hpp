// Messages of libbabeltrace2 into Events: for running sessions and for the babeltrace2 plugin.
#pragma once

#include <cie/analysis/event.hpp>

#include "analyzer_input.hpp"
#include "bt_fields.hpp"
#include "bt_handles.hpp"
#include "vocabulary/pid_namespaces.hpp"
#include "vocabulary/vocabulary.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

class MessageDecoder {
 public:
  // What somebody knows of a stream that has not begun here.
  enum class Foretold : std::uint8_t {
    events,   // it has some
    nothing,  // it has none
    silence,  // none for long
    unknown
  };

  // `input` is borrowed and fed.
  explicit MessageDecoder(AnalyzerInput& input) : input_(input) {}

  // Before its beginning is consumed.
  void foretell(const bt_stream* stream, Foretold what) { foretold_[stream] = what; }
  void consume(const bt_message* message);
  // No more messages come, though streams have not ended: they end with what came last.
  void give_up();
  // Numbers of the traces that messages were of, as StreamBegin tells them.
  std::vector<std::uint32_t> traces() const;

 private:
  // One class of events: where its payload and contexts have what we read.
  struct EventPlan {
    const Translation* translation = nullptr;
    FieldTable payload;
    FieldTable common_context;    // as context_requests() has them
    FieldTable specific_context;  // the same, for tracers that write them there
    std::string name;
  };
  struct Trace {
    VocabularyState state;
    Domain domain = Domain::user;
    std::string host;
    std::uint32_t number = 0;
    bool is_snapshot = false;
    TraceRef trace;  // keeps the addresses below from being reused
  };
  struct Stream {
    StreamIndex index{};
    Trace* trace = nullptr;
    FieldTable packet_context;  // cpu_id
    std::optional<std::int32_t> cpu;
    Timestamp last;
    bool has_packet_times = false;
    bool has_begun = false;
    std::optional<Timestamp> packet_begin;  // of the one that has not ended
    bool has_ended = false;
  };

  Stream& stream_of(const bt_stream* stream);
  EventPlan& plan_of(const bt_event_class* event_class);
  std::optional<bool> take_has_events(const bt_stream* stream, Domain domain);
  void stream_begin(const bt_stream* stream);
  void stream_end(Stream& stream);
  void packet_begin(const bt_message* message);
  void packet_end(const bt_message* message);
  void event(const bt_message* message);
  void discarded_events(const bt_message* message);
  void discarded_packets(const bt_message* message);

  AnalyzerInput& input_;
  std::unordered_map<const bt_stream*, Stream> streams_;
  std::unordered_map<const bt_stream*, Foretold> foretold_;  // of streams about to begin
  std::unordered_map<const bt_event_class*, EventPlan> plans_;
  std::unordered_map<const bt_trace*, std::unique_ptr<Trace>> traces_;
  std::unordered_map<std::string, PidNamespaces> namespaces_;  // by host
  std::map<std::pair<const bt_trace*, std::uint64_t>, std::uint32_t> channels_;
};

}  // namespace cie::analysis::bt
