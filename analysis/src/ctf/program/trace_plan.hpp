// How to read the packets and events of one trace: its metadata compiled against the vocabularies.
#pragma once

#include <cie/analysis/event.hpp>

#include "ctf/metadata/types.hpp"
#include "ctf/metadata/uuid.hpp"
#include "event_choice.hpp"
#include "layout.hpp"
#include "scope.hpp"
#include "vocabulary/tracer_clock.hpp"
#include "vocabulary/vocabulary.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

namespace cie::analysis::ctf {

// Slots of packet headers and contexts.
enum class PacketHeaderSlot : std::uint8_t { magic, uuid, stream_id, stream_instance_id };
enum class PacketContextSlot : std::uint8_t {
  packet_size,
  content_size,
  timestamp_begin,
  timestamp_end,
  events_discarded,
  packet_seq_num,
  cpu_id
};
// Slots of event contexts and headers.
enum class ContextSlot : std::uint8_t { pid, tid, name, pid_ns };
inline constexpr std::size_t kContextSlots = 4;
enum class EventHeaderSlot : std::uint8_t { id, time };

template <typename Slot>
constexpr std::size_t slot(Slot value) noexcept {
  return static_cast<std::size_t>(value);
}

// The name of the machine as the tracer's environment tells it; empty if it does not.
std::string host_of(const Metadata& metadata);

struct ClockPlan {
  std::uint64_t frequency = 1'000'000'000;
  std::string uuid;
  std::int64_t offset_ns = 0;

  // Cycles as nanoseconds of this clock, without its offset.
  Timestamp time_of(std::uint64_t cycles) const noexcept {
    return time_of_cycles(cycles, frequency);
  }
  // Behind them there are no times.
  std::uint64_t last_cycles() const noexcept { return most_cycles(frequency); }
};

// One class of events.
struct EventPlan {
  std::uint32_t number = 0;  // of the trace's classes of events, from 0
  std::string name;
  const Translation* translation = nullptr;  // null: of no vocabulary
  // Its translation follows from earlier events, or is left to who remembers them.
  bool is_filled_at_once = false;
  const Sequence* context = nullptr;  // null: nothing to read
  const Sequence* fields = nullptr;
  bool has_own_pid = false;  // the tracer wrote it into this context, not the common one
  bool has_own_tid = false;
  bool is_shown = false;      // all of its fields are
  bool is_malformed = false;  // it cannot be understood
  // They are read, and the programs made, when its class is asked for.
  std::string_view unread_fields{};
  OtherEvent other{};  // what it becomes without a translation, but for its fields
  // It means nothing to anybody, and nobody asks for it.
  bool is_other() const noexcept {
    return translation == nullptr && !is_shown && other.event_class == OtherEvent::kNoClass;
  }

  // What the programs read, if all of it has fixed places: contexts and fields one after the other.
  struct FixedBody {
    std::uint64_t bytes = 0;
    std::array<FixedField, kContextSlots> context{};  // by ContextSlot
    std::vector<FixedField> fields{};                 // by slot of the translation
  };
  std::optional<FixedBody> fixed;
};

class TracePlan;

// One class of streams.
class StreamPlan {
 public:
  std::uint64_t id = 0;
  const Sequence* packet_context = nullptr;
  const Sequence* event_header = nullptr;
  const Sequence* event_context = nullptr;
  const Sequence* shown_context = nullptr;  // the same for events that are shown
  bool has_event_id = false;                // otherwise there is one class of events
  bool has_event_time = false;
  bool starts_callbacks = false;  // it declares such an event
  bool has_packet_times = false;  // begin and end
  ClockPlan clock;
  std::optional<HeaderLayout> header_layout;

  // Null if the metadata has none of that id.
  const EventPlan* find(std::uint64_t event_id) const {
    auto* event = known(event_id);
    if (event != nullptr && !event->unread_fields.empty()) [[unlikely]]
      complete(event_id, *event);
    return event;
  }

  static constexpr std::uint64_t kNotFixed = std::uint64_t{1} << 60U;  // more than any memory has
  // What whoever steps over events of an id needs to know of their class.
  struct Fixed {
    std::uint64_t bytes = kNotFixed;  // of the body
    std::uint16_t event_class = 0;    // EventPlan::number
    bool is_other = false;            // see EventPlan
  };
  std::span<const Fixed> fixed_events() const noexcept { return fixed_; }  // by id
  // So many bytes must be readable where such an event begins, whichever it is.
  std::uint64_t most_fixed_bytes() const noexcept { return most_fixed_bytes_; }

 private:
  friend class TracePlan;
  EventPlan* known(std::uint64_t event_id) const noexcept {
    if (event_id < dense_.size()) return dense_[event_id];
    const auto found = sparse_.find(event_id);
    return found == sparse_.end() ? nullptr : found->second;
  }
  void complete(std::uint64_t event_id, EventPlan& event) const;
  void make_fixed(std::size_t event_id, const EventPlan& event);

  TracePlan* trace_ = nullptr;  // that it is of
  std::vector<EventPlan*> dense_;
  std::vector<Fixed> fixed_;  // of dense_
  std::uint64_t most_fixed_bytes_ = 0;
  std::unordered_map<std::uint64_t, EventPlan*> sparse_;
};

// Readers of all its streams share it, on one thread at a time: classes of events are completed as
// they are asked for.
class TracePlan {
 public:
  // With a `choice` events have no vocabulary: they are what it wants of them. Borrowed, it outlives
  // the plan. Throws MetadataError.
  explicit TracePlan(const Metadata& metadata, EventChoice* choice = nullptr);
  TracePlan(const TracePlan&) = delete;
  TracePlan& operator=(const TracePlan&) = delete;

  std::optional<Uuid> uuid;
  std::string host;
  bool is_snapshot = false;  // of a flight recorder
  PacketWriter writer = PacketWriter::unknown;
  Domain domain = Domain::user;
  std::int32_t priority_offset = 0;     // see VocabularyState
  bool tells_pid_namespace = false;     // in the context of some events
  bool has_stream_per_cpu = false;      // LTTng's tracers write so
  std::optional<bool> has_inheritance;  // see StreamBegin, as the next two
  std::optional<bool> has_callback_events;
  std::optional<bool> has_client_events;
  const Sequence* packet_header = nullptr;
  bool has_magic = false;
  bool has_header_uuid = false;
  bool has_stream_id = false;
  ByteOrder byte_order = ByteOrder::little;
  std::uint32_t malformed_classes = 0;  // of events
  std::string malformed;                // the first one, and why; empty: there is none

  std::size_t event_classes() const noexcept { return events_.size(); }
  const EventPlan& event_class(std::size_t number) const noexcept { return *events_[number]; }
  const StreamPlan* find(std::uint64_t stream_id) const noexcept;
  // The only class of streams, for packets that do not say theirs; null if there are several.
  const StreamPlan* only_stream() const noexcept;
  // Of a stream of which no packet can be found: that of the first class of streams.
  ClockPlan clock() const {
    return streams_.empty() ? ClockPlan{} : streams_.begin()->second.clock;
  }

 private:
  friend class StreamPlan;
  using EventsOfStreams = std::map<std::uint64_t, std::vector<const EventClass*>>;

  void add_stream(const Metadata& metadata, const StreamClass& stream,
                  std::span<const EventClass* const> events);
  static void find_layouts(const StreamPlan& stream, EventPlan& event);
  void add_event(StreamPlan& plan, const EventClass& event, const std::vector<Scope*>& earlier);
  // Packets can be read as far as none of its events is there.
  void add_event_or_malformed(StreamPlan& plan, const EventClass& event,
                              const std::vector<Scope*>& earlier);
  void enter(StreamPlan& stream, std::uint64_t event_id, std::unique_ptr<EventPlan> event);
  void complete(StreamPlan& stream, EventPlan& event);
  void choose(EventPlan& plan) const;
  bool has_class(const std::string& name) const;
  const Sequence* keep_program(const Scope& scope);
  Scope& new_scope(std::string_view root, RegisterRange& registers,
                   const std::vector<Scope*>& earlier);

  EventChoice* choice_;
  std::shared_ptr<TypeReader> reader_;
  BuildContext context_;
  RegisterRange trace_registers_;
  std::vector<std::unique_ptr<RegisterRange>> registers_;
  std::vector<std::unique_ptr<Scope>> scopes_;
  std::vector<std::shared_ptr<const Sequence>> programs_;
  std::map<std::uint64_t, StreamPlan> streams_;
  std::vector<std::unique_ptr<EventPlan>> events_;
  std::unordered_set<std::string_view> readable_;  // unread fields, of the reader's text
  std::size_t dense_ids_ = 0;                      // entries of all tables by small ids
};

}  // namespace cie::analysis::ctf
