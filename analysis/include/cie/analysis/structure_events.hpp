// Events about the recording itself: its streams and packets, and what is missing in them.
#pragma once

#include <cie/analysis/event_head.hpp>
#include <cie/analysis/time.hpp>

#include <cstdint>
#include <optional>
#include <string_view>

namespace cie::analysis {

// Who wrote a trace's packets, as far as a reader knows: LTTng's own tracers, or another program that wrote anew what
// they had recorded, as `babeltrace2 -o ctf` does.
enum class PacketWriter : std::uint8_t { unknown, lttng, copier };

struct StreamBegin {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  std::uint32_t channel = 0;  // streams of one channel share a window; dense, given by the reader
  std::uint32_t trace = 0;    // of one session, with all of its channels; likewise
  Domain domain = Domain::user;
  std::string_view host;
  std::string_view clock_uuid;       // the boot id; empty if the clock has none
  std::int64_t clock_offset_ns = 0;  // CLOCK_REALTIME - CLOCK_MONOTONIC as the tracer measured it
  std::string_view path;             // where it lies, for messages
  // It is a flight recorder's: it begins where the buffers were not overwritten yet.
  bool is_snapshot = false;
  PacketWriter writer = PacketWriter::unknown;
  // What a reader knows ahead (empty: it does not). A stream without any event, as of a CPU on
  // which nothing ran, covers everything up to its end, wherever its packets begin. One that has no
  // time in common with most streams of its channel does not narrow their window.
  std::optional<bool> has_events{};
  bool is_left_out = false;
  // Whether a kernel's trace that declares sched_switch declares sched_pi_setprio, too.
  std::optional<bool> has_inheritance{};
  // Of the user's, whose trace declares starts of callbacks; false: what applications make at their
  // begin alone was recorded, as by the first session of `ros2 trace --dual-session`.
  std::optional<bool> has_callback_events{};
  // Likewise, ROS 2's rcl_client_init and rcl_service_init.
  std::optional<bool> has_client_events{};
  // It declares none itself, but its trace does: it describes objects and clocks, as far as a reader knows.
  bool is_descriptive = false;
  // Classes of events of its trace that cannot be understood, and the first one with the reason; told by
  // the trace's first stream.
  std::uint32_t malformed_classes = 0;
  std::string_view malformed{};
};
struct StreamEnd {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
};
struct PacketBegin {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  // Where the packet lies, if that is another file than the one before it does; of a stream's first
  // packet, than the one its StreamBegin names.
  std::string_view file{};
};  // head.time: the packet's begin
struct PacketEnd {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
};
// Events or packets the tracer threw away between two points of a stream.
struct Discarded {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  Timestamp begin;
  Timestamp end;
  std::optional<std::uint64_t> count;  // empty: unknown how many
  bool packets = false;                // whole packets rather than events
  // Until this event of its stream the packet had room for more. Empty: that is not known.
  std::optional<Timestamp> last_with_room{};
};
// A packet that cannot be read and was skipped.
struct DamagedPacket {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  std::string_view reason;
  // What it may have covered; empty: the time of the event.
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
  // Nothing was skipped, but it was read with other metadata than its own.
  bool has_foreign_metadata = false;
};
// Nobody recorded the applications of a host between the end of one session and the begin of another,
// whose first packet this follows. They need not have gone on meanwhile.
struct SessionGap {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  Timestamp begin;
  Timestamp end;
  bool is_before_runs = false;  // no session of the host had recorded runs of callbacks before
};
// Time ran backwards in a stream.
struct TimeRegression {
  static constexpr EventCategory kCategory = EventCategory::structure;
  static constexpr std::string_view kName{};
  Timestamp previous;
};

}  // namespace cie::analysis
