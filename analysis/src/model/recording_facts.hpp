// Facts about the recording itself, and what facts of every kind are made of: references to events.
#pragma once

#include <cie/analysis/context_number.hpp>
#include <cie/analysis/event.hpp>
#include <cie/analysis/identity.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::analysis {

// No event's stream: of points in time that no event marks.
inline constexpr StreamIndex kNoStream{0xffffffff};

// Where and when an event happened: what evidence is made of.
struct EventRef {
  Timestamp time{};
  StreamIndex stream = kNoStream;
  ContextNumber<std::int32_t> cpu{};
  ContextNumber<std::int64_t> pid{};
  ContextNumber<std::int64_t> tid{};
};
static_assert(sizeof(EventRef) == 24, "facts hold dozens of them for each callback and thread");
inline EventRef ref(const EventHead& head) noexcept {
  // As a whole: what was written in parts and is copied at once makes the processor wait.
  static_assert(std::is_standard_layout_v<EventHead> && std::is_trivially_copyable_v<EventRef> &&
                offsetof(EventHead, stream) == offsetof(EventRef, stream) &&
                offsetof(EventHead, cpu) == offsetof(EventRef, cpu) &&
                offsetof(EventHead, pid) == offsetof(EventRef, pid) &&
                offsetof(EventHead, tid) == offsetof(EventRef, tid));
  EventRef where;
  std::memcpy(static_cast<void*>(&where), &head, sizeof where);
  return where;
}

struct StreamFacts {
  std::uint32_t channel = 0;
  std::uint32_t trace = 0;  // whose stream it is
  Domain domain = Domain::user;
  HostIndex host{};
  std::optional<std::int32_t> cpu{};  // of a kernel stream
  std::string path{};
  std::string clock_uuid{};
  std::int64_t clock_offset_ns = 0;
  std::optional<Timestamp> begin{};  // first packet's begin
  std::optional<Timestamp> end{};    // last packet's end
  // The first and last start or end of a callback that tells something of it; not each of all.
  std::optional<Timestamp> first_run{};
  std::optional<Timestamp> last_run{};
  // What the window of its channel is made of: empty of a stream that does not narrow it there.
  std::optional<Timestamp> covers_from{};
  std::optional<Timestamp> covers_to{};
  bool has_ended = false;  // none follows it
  PacketWriter writer = PacketWriter::unknown;
  bool is_descriptive = false;  // see StreamBegin
  std::uint64_t packets = 0;
  std::vector<Timestamp> packet_begins{};  // of the first million
  struct File {
    std::uint64_t first_packet = 0;
    std::string path{};
  };
  std::vector<File> later_files{};  // after `path`, in order
  std::uint64_t events = 0;
  bool is_evidence = true;   // false: of the kernel, and no clock relates it to its host's others
  bool is_left_out = false;  // it has no time in common with the rest of its channel
  bool is_apart = false;     // no time is common to its channel: nothing of that is counted
  std::optional<bool> has_inheritance{};  // see StreamBegin
  bool has_callback_events = true;        // likewise, unless it is known not to
  bool has_client_events = true;          // likewise
  std::uint32_t malformed_classes = 0;    // likewise, as the next one
  std::string malformed{};
};

// Window of a channel: [latest first-packet begin, earliest last-packet end] over its streams that
// have events.
struct ChannelFacts {
  Domain domain = Domain::user;
  HostIndex host{};
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
  bool has_callback_events = true;  // its streams do
};

enum class LossKind : std::uint8_t {
  discarded_events,
  discarded_packets,
  damaged_packet,
  foreign_metadata,  // what was read with other metadata than its own
  switch_mismatch,   // a sched_switch whose prev_tid is not the CPU's last next_tid
  host_gap           // between two sessions, while a process went on
};
struct Loss {
  LossKind kind = LossKind::discarded_events;
  Domain domain = Domain::user;
  HostIndex host{};
  Timestamp begin = kBoot;  // which is: since when is not known
  Timestamp end{};
  std::optional<std::uint64_t> count{};  // events or packets; empty: unknown
  std::optional<std::int32_t> cpu{};
  std::string note{};       // stream, reason
  bool is_evidence = true;  // as its stream
  std::uint64_t times = 1;  // it stands for so many, which the list had no room for
};

// On the machine's own clock.
struct HostGap {
  HostIndex host{};
  Timestamp from;
  Timestamp to;
  bool is_before_runs = false;  // see SessionGap
};

// Of what has no numbers, runs outside every window, while a session before them and one after them
// recorded their process.
struct RunsBetweenSessions {
  HostIndex host{};
  ProcessIndex process{};
  StreamIndex stream = kNoStream;  // of the first one
  bool is_before = false;          // the window of its channel
  Timestamp begin;
  Timestamp end;
  std::uint64_t count = 1;
};

struct HostFacts {
  std::string name{};  // as told, but for namesakes: with their boot behind it
  std::string told{};  // by the tracer
  std::string clock_uuid{};
  std::optional<std::int64_t> clock_offset_ns{};  // of its first stream that has one
  bool is_clock_set = false;                      // CLOCK_REALTIME, within the recording
  bool has_switches = false;                      // kernel events by class
  bool has_wakings = false;
  bool has_forks = false;
  std::uint32_t cpus_not_recorded = 0;  // it has them, and kernel streams, but none of theirs
};

using HostPair = std::pair<HostIndex, HostIndex>;  // from, to

// Messages from one host to another, by the times that their clocks showed.
struct HostClockFacts {
  std::uint64_t messages = 0;
  Duration shortest{};
};

// Which event classes and contexts the trace has at all (T5 and "event class absent").
struct EventCounts {
  std::uint64_t total = 0;
  std::map<std::string, std::uint64_t, std::less<>> by_name{};  // of the vocabularies we know
  std::uint64_t cie = 0;
  std::uint64_t cie_without_pid = 0;
  std::uint64_t cie_without_tid = 0;
};

struct TimeRegressionFacts {
  std::uint64_t count = 0;
  std::optional<EventRef> first{};
  Timestamp first_previous{};
};

}  // namespace cie::analysis
