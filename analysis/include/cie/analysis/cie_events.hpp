// The events of the contract, `cie:*` (tracepoints/README.md): who there is, and what callbacks do. Other
// vocabularies are translated into them.
#pragma once

#include <cie/analysis/event_head.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace cie::analysis {

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
  std::int64_t monotonic_offset_ns = 0;
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
// What a translator infers of a callback from other events: of ROS 2's alone. An event of the contract
// says all of its callback itself.
struct InferredCallback {
  std::optional<Timestamp> first_expiry{};  // of rcl's timers, from which their others follow
  Duration expiry_spread{};                 // all of them may be earlier by up to that
  // False: what makes its logical id was recorded in part only; others may have that id, too.
  bool is_identified = true;
  // It was made since an rcl_init that was not the first sign of its pid, perhaps in another process.
  bool is_after_rcl_init = false;
  std::optional<Timestamp> made{};  // when its tracer tells it was
  // Since such an rcl_init it and another one have an address one after the other: instances of one may
  // be told as the other's. `former`: the one before it; kNoCallback: none, or not told.
  bool shares_address = false;
  CallbackId former = kNoCallback;
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
  InferredCallback inferred{};
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
  // another one's by now; or InferredCallback::shares_address.
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
// The message of a `publish` that reached nobody.
struct PublishFailed {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName = "publish_failed";
  PublisherId publisher{};
  std::int64_t source_timestamp_realtime_ns = 0;
  std::uint64_t total = 0;
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

}  // namespace cie::analysis
