// What readers push and analyses consume: one small, trivially copyable value per event, the same
// for every vocabulary. Views are valid only during consume(); whoever keeps a string interns it.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

namespace cie::analysis {

struct Field;
struct FixedField;

// An event's fields where a reader has them: collected in slots, or at fixed places in memory.
// Borrowed as long as the event is being consumed. What reads them is internal.
struct RawFields {
  const Field* slots = nullptr;
  const std::uint8_t* begin = nullptr;
  const FixedField* fixed = nullptr;
};

// Dense numbers given by the reader: one stream is one sequence of packets (usually one CPU's
// buffer of one channel of one trace).
enum class StreamIndex : std::uint32_t {};

// A field that the trace does not have stays empty; it is never 0.
struct EventHead {
  Timestamp time;
  StreamIndex stream{};
  std::optional<std::int32_t> cpu;
  std::optional<std::int64_t> pid;  // vpid, as the tracer knows it
  std::optional<std::int64_t> tid;  // vtid
  bool is_derived = false;          // follows from other events: none of the trace's own
};

// --- about the recording itself ------------------------------------------------------------------
enum class Domain : std::uint8_t { user, kernel };

struct StreamBegin {
  std::uint32_t channel = 0;  // streams of one channel share a window; dense, given by the reader
  Domain domain = Domain::user;
  std::string_view host;
  std::string_view clock_uuid;       // the boot id; empty if the clock has none
  std::int64_t clock_offset_ns = 0;  // CLOCK_REALTIME - CLOCK_MONOTONIC as the tracer measured it
  std::string_view path;             // where it lies, for messages
  // Of a flight recorder: begins where the buffers were not overwritten yet.
  bool is_snapshot = false;
};
struct StreamEnd {};
struct PacketBegin {};  // head.time: the packet's begin
struct PacketEnd {};
// Events or packets the tracer threw away between two points of a stream.
struct Discarded {
  Timestamp begin;
  Timestamp end;
  std::optional<std::uint64_t> count;  // empty: unknown how many
  bool packets = false;                // whole packets rather than events
};
// A packet that cannot be read and was skipped.
struct DamagedPacket {
  std::string_view reason;
  // What it may have covered; empty: the time of the event.
  std::optional<Timestamp> begin{};
  std::optional<Timestamp> end{};
  // Nothing was skipped, but it was read with other metadata than its own.
  bool has_foreign_metadata = false;
};
// Time ran backwards in a stream.
struct TimeRegression {
  Timestamp previous;
};

// --- cie:* ---------------------------------------------------------------------------------------
struct RunBegin {
  std::uint32_t contract_version = 0;
  std::string_view tool_version;
  std::string_view executor;
  std::string_view boot_id;
  std::string_view host;
  std::uint32_t pid = 0;
  std::uint64_t pid_ns = 0;
  std::int64_t process_start_ns = 0;
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;
  std::uint32_t online_cpus = 0;
  std::string_view spec_sha256;
  std::optional<RunMoment> moment;
};
struct RunEnd {
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;
};
struct NodeInit {
  NodeId node{};
  std::string_view name;
};
struct GroupInit {
  GroupId group{};
  NodeId node{};
  std::optional<GroupType> type;
};
struct CallbackInit {
  CallbackId callback{};
  GroupId group{};
  NodeId node{};
  std::optional<CallbackKind> kind;
  std::string_view logical_id;
  std::string_view source;
  std::string_view symbol;
  std::uint64_t period_ns = 0;
  std::uint32_t queue_depth = 0;
  std::uint64_t deadline_ns = 0;
  std::uint64_t next_seq = 0;
};
struct CallbackFini {
  CallbackId callback{};
  std::uint64_t started = 0;
  std::uint64_t ended = 0;
  std::uint64_t released = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t lost = 0;
};
struct PublisherInit {
  PublisherId publisher{};
  NodeId node{};
  std::string_view topic;
  std::uint64_t writer_gid = 0;
  std::uint64_t next_seq = 0;
};
struct PublisherFini {
  PublisherId publisher{};
  std::uint64_t published = 0;
};
struct ThreadInit {
  std::uint32_t tid = 0;
  std::optional<ThreadRole> role;
  CallbackId callback{};
  GroupId group{};
  std::string_view name;
  std::int64_t start_ns = 0;
};
struct ThreadFini {
  std::uint32_t tid = 0;
  std::uint32_t read_backs = 0;
};
struct ThreadSched {
  std::uint32_t tid = 0;
  std::optional<SchedMoment> moment;
  std::uint32_t n = 0;
  std::int32_t policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
  std::span<const std::uint32_t> cpus;
  std::int32_t error = 0;
  std::optional<std::uint64_t> slice_ns{};  // from here on absent in older recordings
  std::optional<std::uint32_t> util_min{};
  std::optional<std::uint32_t> util_max{};
  std::uint32_t change = 0;  // of the thread's parameters: which one this read-back belongs to
};
struct CallbackRelease {
  CallbackId callback{};
  std::uint64_t release_seq = 0;
  std::uint64_t overwritten = 0;
};
struct ThreadWakeup {
  CallbackId callback{};
  std::optional<WakeupReason> reason;
};
struct CallbackStart {
  CallbackId callback{};
  std::uint64_t seq = 0;
  std::optional<ReleaseKind> release_kind;
  std::int64_t release_ns = -1;
  std::uint32_t missed = 0;
  std::int64_t source_timestamp_realtime_ns = 0;
  std::uint64_t writer_gid = 0;
};
struct CallbackEnd {
  CallbackId callback{};
  std::uint64_t seq = 0;
  std::optional<CallbackStatus> status;
};
struct Publish {
  PublisherId publisher{};
  std::uint64_t seq = 0;
  std::int64_t source_timestamp_realtime_ns = 0;
};
struct SampleLost {
  CallbackId callback{};
  std::uint32_t count = 0;
  std::uint64_t total = 0;
};
struct ClockSync {
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;
};

// --- kernel (priorities already normalised: 99 - rt for FIFO and RR, 120 + nice, -1 for DEADLINE)
// ---
struct SchedSwitch {
  std::string_view prev_comm;
  std::int64_t prev_tid = 0;
  std::int32_t prev_prio = 0;
  std::int64_t prev_state = 0;  // as the kernel wrote it
  std::string_view next_comm;
  std::int64_t next_tid = 0;
  std::int32_t next_prio = 0;
};
struct SchedWaking {
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedWakeup {
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedProcessFork {
  std::int64_t parent_tid = 0;
  std::int64_t parent_pid = 0;
  std::int64_t child_tid = 0;
  std::int64_t child_pid = 0;
  std::string_view child_comm;
};
struct SchedProcessExit {
  std::int64_t tid = 0;
};
struct SchedMigrateTask {
  std::int64_t tid = 0;
  std::int32_t orig_cpu = 0;
  std::int32_t dest_cpu = 0;
};
struct SchedPiSetprio {
  std::int64_t tid = 0;
  std::int32_t old_prio = 0;
  std::int32_t new_prio = 0;
};

// --- LTTng: what a process calls itself, told when a session starts ---
struct ProcessName {
  std::string_view name;
};

// An event of no vocabulary we know: counted.
struct OtherEvent {
  std::string_view name;
};

// An event whose meaning depends on earlier ones. The analyzer has it replaced, first of all, by
// those of the model that follow from it.
struct Untranslated {
  std::uint32_t kind = 0;  // its vocabulary's
  RawFields fields{};
};

using EventBody =
    std::variant<StreamBegin, StreamEnd, PacketBegin, PacketEnd, Discarded, DamagedPacket,
                 TimeRegression, RunBegin, RunEnd, NodeInit, GroupInit, CallbackInit, CallbackFini,
                 PublisherInit, PublisherFini, ThreadInit, ThreadFini, ThreadSched, CallbackRelease,
                 ThreadWakeup, CallbackStart, CallbackEnd, Publish, SampleLost, ClockSync,
                 SchedSwitch, SchedWaking, SchedWakeup, SchedProcessFork, SchedProcessExit,
                 SchedMigrateTask, SchedPiSetprio, ProcessName, OtherEvent, Untranslated>;

struct Event {
  EventHead head;
  EventBody body;
};

// Visits an EventBody with lambdas (the deduction guide is for clang 14).
template <typename... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <typename... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

}  // namespace cie::analysis
