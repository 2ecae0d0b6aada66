// What readers push and analyses consume: one small, trivially copyable value per event, the same
// for every vocabulary. Views are valid only during consume(); whoever keeps a string interns it.
#pragma once

#include <cie/analysis/context_number.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

namespace cie::analysis {

// Dense numbers given by the reader: one stream is one sequence of packets (usually one CPU's
// buffer of one channel of one trace).
enum class StreamIndex : std::uint32_t {};

// A field that the trace does not have stays empty; it is never 0.
struct EventHead {
  Timestamp time;
  StreamIndex stream{};
  ContextNumber<std::int32_t> cpu;
  ContextNumber<std::int64_t> pid;  // vpid, as the tracer knows it
  ContextNumber<std::int64_t> tid;  // vtid
  bool is_derived = false;          // follows from other events: none of the trace's own
  // Derived, and in the place of the event that it follows from, which counts as the trace's own.
  bool stands_for_cause = false;
};

// What a kind of event is about.
enum class EventCategory : std::uint8_t {
  structure,  // streams and packets: no event of the trace itself
  state,      // who there is: processes, nodes, callbacks, threads and their parameters
  callback,   // what callbacks do
  clock,      // of our provider, about its clock
  system      // of the kernel and of tracers, whatever thread was running
};
// Each kind below says its category, and the name of its event class (empty: no single one).

// --- about the recording itself ------------------------------------------------------------------
enum class Domain : std::uint8_t { user, kernel };

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
  // What a reader knows ahead (empty: it does not). A stream without any event, as of a CPU on
  // which nothing ran, covers everything up to its end, wherever its packets begin. One that has no
  // time in common with most streams of its channel does not narrow their window.
  std::optional<bool> has_events{};
  bool is_left_out = false;
  // Whether a kernel's trace that declares sched_switch declares sched_pi_setprio, too.
  std::optional<bool> has_inheritance{};
  // Of the user's, whose trace declares starts of callbacks; false: what applications make at their
  // begin alone was recorded, as by the first session of `ros2 trace --dual-session`.
  std::optional<bool> tells_runs{};
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

// --- cie:* ---------------------------------------------------------------------------------------
struct RunBegin {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "run_begin";
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
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "run_end";
  std::uint32_t callbacks = 0;
  std::uint32_t threads = 0;
  std::uint32_t groups = 0;
  std::uint32_t publishers = 0;
  std::int32_t status = 0;
};
struct NodeInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "node_init";
  NodeId node{};
  std::string_view name;
};
struct GroupInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "group_init";
  GroupId group{};
  NodeId node{};
  std::optional<GroupType> type;
};
struct CallbackInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "callback_init";
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
  std::optional<Timestamp> first_expiry{};  // of rcl's timers, from which their others follow
  Duration expiry_spread{};                 // all of them may be earlier by up to that
  // False: what makes its logical id was recorded in part only; others may have that id, too.
  bool is_identified = true;
  // It was made since an rcl_init that was not the first sign of its pid, perhaps in another process.
  bool is_after_rcl_init = false;
  // Since such an rcl_init it and another one have an address one after the other: instances of one may
  // be told as the other's. `former`: the one before it; kNoCallback: none, or not told.
  bool shares_address = false;
  CallbackId former = kNoCallback;
};
struct CallbackFini {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "callback_fini";
  CallbackId callback{};
  std::uint64_t started = 0;
  std::uint64_t ended = 0;
  std::uint64_t released = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t lost = 0;
};
struct PublisherInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "publisher_init";
  PublisherId publisher{};
  NodeId node{};
  std::string_view topic;
  std::uint64_t writer_gid = 0;
  std::uint64_t next_seq = 0;
};
struct PublisherFini {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "publisher_fini";
  PublisherId publisher{};
  std::uint64_t published = 0;
};
struct ThreadInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "thread_init";
  std::uint32_t tid = 0;
  std::optional<ThreadRole> role;
  CallbackId callback{};
  GroupId group{};
  std::string_view name;
  std::int64_t start_ns = 0;
};
struct ThreadFini {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "thread_fini";
  std::uint32_t tid = 0;
  std::uint32_t read_backs = 0;
};
struct ThreadSched {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "thread_sched";
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
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "callback_release";
  CallbackId callback{};
  std::uint64_t release_seq = 0;
  std::uint64_t overwritten = 0;
  bool may_be_another = false;  // see CallbackStart
};
struct ThreadWakeup {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "thread_wakeup";
  CallbackId callback{};
  std::optional<WakeupReason> reason;
};
struct CallbackStart {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "callback_start";
  CallbackId callback{};
  std::uint64_t seq = 0;
  std::optional<ReleaseKind> release_kind;
  std::int64_t release_ns = -1;
  std::uint32_t missed = 0;
  std::int64_t source_timestamp_realtime_ns = 0;  // below 0: a name that tells no time
  std::uint64_t writer_gid = 0;
  // One of the publications that were recorded may be the message taken; which is not told.
  bool is_writer_undecided = false;
  // Its callback is known by an address, of which events that were lost since may have told that it is
  // another one's by now; or CallbackInit::shares_address.
  bool may_be_another = false;
  // The next event of all, in the same stream, was its end, then. It is told by this alone: of ROS
  // 2's callbacks two of three end so.
  std::optional<Timestamp> end{};
};
struct CallbackEnd {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "callback_end";
  CallbackId callback{};
  std::uint64_t seq = 0;
  std::optional<CallbackStatus> status;
  bool may_be_another = false;  // see CallbackStart; of one whose start was not seen
};
struct Publish {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "publish";
  PublisherId publisher{};
  std::uint64_t seq = 0;
  std::int64_t source_timestamp_realtime_ns = 0;  // below 0: a name that tells no time
  // The instance that it is of, if not the one that its thread runs.
  CallbackId callback = kNoCallback;
  std::uint64_t callback_seq = 0;
  // What its thread ran may have ended since, unseen.
  bool is_runner_unknown = false;
};
struct SampleLost {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "sample_lost";
  CallbackId callback{};
  std::uint32_t count = 0;
  std::uint64_t total = 0;
};
struct ClockSync {
  static constexpr EventCategory kCategory = EventCategory::clock;
  static constexpr std::string_view kName = "clock_sync";
  std::int64_t monotonic_ns = 0;
  std::int64_t realtime_ns = 0;
};

// --- of processes that ROS 2's tracers tell of: these only follow from other events ---------------
struct Ros2Begin {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "rcl_init";
};  // nothing of the process came before
// The process spoke before a gap between two sessions, and does so behind it.
struct LivedOn {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  Timestamp since;       // its last event before
  StreamIndex stream{};  // of that
};
// Instances on a thread overlap and do not nest, which those of one thread cannot.
struct CrossedRuns {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
};
// In a process that tells in this project's events, ROS 2's tell of an instance since another rcl_init.
struct RunBesideOwn {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
};
// In a process that tells in this project's events, ROS 2's tell of a callback that none of these tells of,
// or of an instance that is none of theirs: another executor runs there.
struct CallbackBesideOwn {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName{};
  std::string_view logical_id;
  std::optional<Timestamp> ran{};  // empty: it was made
  StreamIndex stream{};            // of that
};
// What the process's tracepoints are of.
struct Ros2Tracer {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::string_view version;  // of tracetools, "4.1.1"
};
// A callback whose runs no event shows. Told again when its group is known.
struct HiddenInit {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::uint32_t hidden = 0;  // in its process, counted from 0
  GroupId group{};
  bool is_client = false;  // else a service
  bool is_action = false;  // its part in an action
  bool is_pooled = false;  // the executor of its group is told to have several threads
  std::string_view what;   // "the client of /car/enable"
  std::string_view node;
};
// Somebody whose publications are not recorded writes on the topic, and publications there tell no
// source timestamps: which one a message was taken of is not proven.
struct UnseenWriter {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::string_view topic;
};
// The thread took a response of a hidden client.
struct HiddenRun {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
  std::uint32_t hidden = 0;
};
// The thread took a service's response, by what names its publication.
struct ResponseTaken {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp_realtime_ns = 0;
};

// What the kernel calls a thread: a copy, for it has no more than TASK_COMM_LEN bytes (linux/sched.h). Of a
// longer text, which no kernel wrote, these are the first.
class TaskName {
 public:
  TaskName() noexcept = default;
  // NOLINTNEXTLINE(google-explicit-constructor): whoever makes events gives a text
  TaskName(std::string_view name) noexcept { name.copy(characters_.data(), characters_.size()); }
  // NOLINTNEXTLINE(google-explicit-constructor): likewise
  TaskName(const char* name) noexcept : TaskName(std::string_view(name)) {}
  // NOLINTNEXTLINE(google-explicit-constructor): whoever reads them gets one
  operator std::string_view() const noexcept {
    const std::string_view all(characters_.data(), characters_.size());
    return {all.data(), std::min(all.find('\0'), all.size())};
  }

 private:
  std::array<char, 16> characters_{};
};

// --- kernel ---------------------------------------------------------------------------------------
// Priorities are normalised: 99 - rt for FIFO and RR, 120 + nice, -1 for DEADLINE.
struct SchedSwitch {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_switch";
  TaskName prev_comm;
  std::int64_t prev_tid = 0;
  std::int32_t prev_prio = 0;
  std::int64_t prev_state = 0;  // as the kernel wrote it
  TaskName next_comm;
  std::int64_t next_tid = 0;
  std::int32_t next_prio = 0;
};
struct SchedWaking {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_waking";
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedWakeup {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_wakeup";
  std::int64_t tid = 0;
  std::int32_t prio = 0;
  std::optional<std::int32_t> target_cpu;
};
struct SchedProcessFork {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_process_fork";
  std::int64_t parent_tid = 0;
  std::int64_t parent_pid = 0;
  std::int64_t child_tid = 0;
  std::int64_t child_pid = 0;
  TaskName child_comm;
};
struct SchedProcessExit {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_process_exit";
  std::int64_t tid = 0;
};
struct SchedMigrateTask {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_migrate_task";
  std::int64_t tid = 0;
  std::int32_t orig_cpu = 0;
  std::int32_t dest_cpu = 0;
};
struct SchedPiSetprio {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "sched_pi_setprio";
  std::int64_t tid = 0;
  std::int32_t old_prio = 0;
  std::int32_t new_prio = 0;
};

// --- LTTng: what a process calls itself, told when a session starts ---
struct ProcessName {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName = "lttng_ust_statedump:procname";
  std::string_view name;
};

// A step through an event's fields as its trace declares them, in their order.
struct FieldValue {
  enum class Kind : std::uint8_t {
    integer,
    natural,  // an integer without a sign: `number` wraps above int64
    boolean,  // 0 or 1
    label,    // of an enumeration: `number`, and what that is called in `text`
    real,     // the bits of a double
    text,     // bytes as they were recorded
    opaque,   // a number of a kind that no machine has
    structure,
    list,  // both: what follows, until `end`, is in it
    end
  };
  Kind kind = Kind::end;
  bool is_hexadecimal = false;  // a number that the trace wants to be shown so
  std::string_view name;        // empty in lists
  std::string_view text{};
  std::int64_t number = 0;
};

// An event that says nothing by itself: of no vocabulary we know, or one from which others follow.
struct OtherEvent {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName{};
  static constexpr std::uint32_t kNoClass = ~std::uint32_t{0};
  std::string_view name;
  // Of a reader that was asked for events themselves (recorded_events.hpp): its class's number
  // instead of the name, and its fields, of which the first `context` values are of contexts.
  std::uint32_t event_class = kNoClass;
  std::uint32_t context = 0;
  std::span<const FieldValue> fields{};
  // It stands for so many, of which the last was no later: readers of files only count what nobody
  // asks for.
  std::uint64_t count = 1;
};

using EventBody =
    std::variant<StreamBegin, StreamEnd, PacketBegin, PacketEnd, Discarded, DamagedPacket,
                 SessionGap, TimeRegression, RunBegin, RunEnd, NodeInit, GroupInit, CallbackInit,
                 CallbackFini, PublisherInit, PublisherFini, ThreadInit, ThreadFini, ThreadSched,
                 CallbackRelease, ThreadWakeup, CallbackStart, CallbackEnd, Publish, SampleLost,
                 ClockSync, Ros2Begin, LivedOn, CrossedRuns, RunBesideOwn, CallbackBesideOwn,
                 Ros2Tracer, HiddenInit, UnseenWriter, HiddenRun, ResponseTaken, SchedSwitch,
                 SchedWaking, SchedWakeup, SchedProcessFork, SchedProcessExit, SchedMigrateTask,
                 SchedPiSetprio, ProcessName, OtherEvent>;

namespace detail {
template <typename... Bodies>
constexpr std::array<EventCategory, sizeof...(Bodies)> categories_of(
    const std::variant<Bodies...>*) {
  return {Bodies::kCategory...};
}
template <typename... Bodies>
constexpr std::array<std::string_view, sizeof...(Bodies)> names_of(const std::variant<Bodies...>*) {
  return {Bodies::kName...};
}
}  // namespace detail

// By index of EventBody.
inline constexpr auto kEventCategories =
    detail::categories_of(static_cast<const EventBody*>(nullptr));
inline constexpr auto kEventNames = detail::names_of(static_cast<const EventBody*>(nullptr));

constexpr EventCategory category_of(const EventBody& body) noexcept {
  return kEventCategories[body.index()];
}

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
