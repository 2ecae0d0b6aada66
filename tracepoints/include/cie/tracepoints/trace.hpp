// What the executor tells the tracer. Objects of this header are the state events: creating one
// registers it and emits its *_init, destroying it emits its *_fini with the totals. The registry
// behind them emits every live one again whenever tracing starts on the running process.
//
// Hot functions are noexcept, never allocate, lock or format, and compile to nothing without LTTng
// (the counters remain, because totals and announcements need them).
//
// Every object may be created, used and destroyed on any thread; use of one object must not overlap
// its destruction. Constructors allocate, take a priority-inheriting lock and may throw
// std::bad_alloc; Run's also std::system_error when its background thread cannot be created, and
// the first object's std::runtime_error when the environment asks for a profile (see
// ros2_profile.hpp) that cannot be had. After fork() a child inherits no registered object: those
// of the parent stay silent in it.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::trace {

// False when this build carries no tracepoints (CIE_WITH_LTTNG=OFF).
bool is_compiled_in() noexcept;

// Scheduling parameters of a thread as the kernel reports them.
struct SchedReadBack {
  std::int32_t policy = 0;  // without SCHED_RESET_ON_FORK
  std::uint64_t flags = 0;  // SCHED_FLAG_*, reset-on-fork included
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0;  // these three for SCHED_DEADLINE only, else 0
  std::uint64_t deadline_ns = 0;
  std::uint64_t period_ns = 0;
  std::vector<std::uint32_t> cpus;  // ascending
  std::uint64_t slice_ns = 0;       // SCHED_OTHER: the time slice; else, and before Linux 6.12, 0
  std::uint32_t util_min = 0;       // utilization clamps, of 1024; both 0 where the kernel has none
  std::uint32_t util_max = 0;
};

// Reads the parameters of a thread of this process (0: the caller) with sched_getattr and
// sched_getaffinity. Empty when the thread is gone, also if another process has its tid now.
// Allocates; any thread may call it.
std::optional<SchedReadBack> read_back(std::uint32_t tid);

// One run of an executor in this process. The first live Run emits `run_begin` and everything that
// was registered before it; `run_end` follows when the last Run and every registered object are
// gone, or when the process calls exit() or returns from main (not at _exit, abort or a signal).
// Hold one for as long as an executor lives. `run_begin` names the spec of the Run that began it and
// the kinds of executor of all: with the first Run of another kind it is emitted again, as is all
// state. Totals and status of `run_end` are the process's, so a later run counts on.
//
// While a Run lives, a background thread named "cie-announce" (SCHED_OTHER, nice 10, all signals
// blocked) announces all state whenever a session starts, and emits `clock_sync` every second while
// traced. It is joined when `run_end` is emitted.
class Run {
 public:
  Run(ExecutorKind executor, std::string_view spec_sha256);
  ~Run();
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  // 0 if every spin returned normally. The last call counts, and of several Runs the greatest: that
  // is the status of `run_end`.
  void set_status(std::int32_t status) noexcept;
  // The process goes on under another spec: `run_begin` is emitted again, with moment announce, and
  // names it from now on; all state follows.
  void set_spec(std::string_view spec_sha256);

 private:
  std::uint64_t generation_;  // 0 in a child of fork(): belongs to the parent
};

class Node {
 public:
  // `name` is fully qualified: "/ns/name".
  explicit Node(std::string_view name);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  NodeId id() const noexcept { return id_; }

 private:
  NodeId id_;
};

class Group {
 public:
  Group(NodeId node, GroupType type);
  ~Group();
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;
  GroupId id() const noexcept { return id_; }

 private:
  GroupId id_;
};

struct CallbackInfo {
  GroupId group = kNoGroup;
  NodeId node = kNoNode;
  CallbackKind kind = CallbackKind::timer;
  std::string logical_id{};  // unique in the process; see unique_logical_id()
  std::string source{};      // topic or service; empty for a timer
  std::string symbol{};      // name of the function, demangled; may be empty
  std::uint64_t period_ns = 0;
  std::uint32_t queue_depth = 0;
  std::uint64_t deadline_ns = 0;
};

// `base` itself if no living callback of this process has it, else the first free one of `base#2`,
// `base#3`, … Thread-safe; claims the id it returns until the callback that gets it goes.
std::string unique_logical_id(std::string_view base);

struct CallbackState;
struct PublisherState;
struct ThreadState;

class Callback {
 public:
  explicit Callback(CallbackInfo info);
  ~Callback();
  Callback(const Callback&) = delete;
  Callback& operator=(const Callback&) = delete;
  CallbackId id() const noexcept { return id_; }

  // From the thread that makes the callback ready. `overwritten`: samples overwritten in its queue
  // so far. Calls for one callback must not overlap, as those of a queue under its lock do not;
  // only those of a waitable may, from any thread or signal handler (one atomic increment).
  void release(std::uint64_t overwritten) noexcept;
  // Samples overwritten in its queue so far, when that is learnt without a release: after the last
  // one, or as the queue goes. Never lowers what is known; emits nothing, but callback_fini and
  // later announcements carry it. Thread-safe.
  void overwritten(std::uint64_t total) noexcept;
  // Number the next start() will carry.
  std::uint64_t next_seq() const noexcept;

  // Around one instance, from the thread that runs it. start() returns the instance's seq, which
  // goes to its end(). Callbacks of a mutually exclusive group rely on the executor never running
  // two instances of one callback at once; those of a reentrant or unknown group may overlap.
  struct Release {
    ReleaseKind kind = ReleaseKind::none;
    std::int64_t release_ns = -1;  // CLOCK_MONOTONIC; -1 unknown
    std::uint32_t missed = 0;      // whole periods skipped before this release
    std::int64_t source_timestamp_realtime_ns = 0;
    std::uint64_t writer_gid = 0;
  };
  std::uint64_t start(const Release& release) noexcept;
  // `release_ns`: the instance's, as start() was told. From it and the declared deadline follows
  // `deadline_miss`, where a session or trigger asks for that event; -1: none.
  void end(std::uint64_t seq, CallbackStatus status, std::int64_t release_ns = -1) noexcept;

  // `count` samples were lost before they reached the queue. Thread-safe.
  void sample_lost(std::uint32_t count) noexcept;

 private:
  CallbackId id_;
  std::shared_ptr<CallbackState> state_;  // shared with the registry, which announces it
};

// The executor moves a callback to other threads: emits its `callback_init` again, which tells
// readers that the move is meant. Call it before the first start there. Nothing of a callback that
// is gone.
void register_again(CallbackId callback);

class Publisher {
 public:
  // `queue_depth`: of the writer's history; 0 unknown. Only the profile `ros2` tells it.
  Publisher(NodeId node, std::string_view topic, std::uint64_t writer_gid,
            std::uint32_t queue_depth = 0);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;
  PublisherId id() const noexcept { return id_; }
  // One message: takes the next seq and the next source timestamp in one lock-free step, emits
  // `publish` and returns the timestamp to write the message with. Several threads may publish: seq
  // and timestamp then rise together, though two events may appear in the trace in swapped order.
  std::int64_t publish() noexcept;

  // The same in two calls, for a single publishing thread (or several that the caller serialises
  // over both calls): the timestamps given to publish() must be strictly increasing.
  void publish(std::int64_t source_timestamp_realtime_ns) noexcept;
  // The message of this timestamp, after its publish(), reaches nobody. `total`: those of the
  // publisher so far. Thread-safe.
  void failed(std::int64_t source_timestamp_realtime_ns, std::uint64_t total) noexcept;
  // CLOCK_REALTIME now, or one more than the previous if the clock did not advance. Thread-safe.
  std::int64_t next_source_timestamp() noexcept;

 private:
  PublisherId id_;
  std::shared_ptr<PublisherState> state_;
};

// A thread of this process. Create it on the thread itself (tid 0), or for another library's thread
// with its tid. Emits `thread_init`, and on destruction a last audit (if the thread still lives)
// and `thread_fini` with the number of read-backs.
class Thread {
 public:
  Thread(ThreadRole role, CallbackId callback, GroupId group, std::string_view name,
         std::uint32_t tid = 0);
  ~Thread();
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;
  std::uint32_t tid() const noexcept { return tid_; }
  // Reads the parameters back from the kernel, emits `thread_sched` and returns them. `error` is
  // the errno of the failed request, 0 otherwise. Empty when the thread is gone, also if another one
  // has its tid now (nothing is emitted).
  std::optional<SchedReadBack> emit_sched(SchedMoment moment, std::int32_t error);
  // Call it before parameters that were applied are changed, and emit_sched(applied) afterwards:
  // emits an audit with the number of the change, which tells readers that until the next `applied`
  // the thread may run as either says.
  void begin_change();

 private:
  std::uint32_t tid_;
  std::shared_ptr<ThreadState> state_;
};

inline constexpr std::int64_t kWaitForever = std::numeric_limits<std::int64_t>::max();

// On a callback's thread, before a wait that ends at `deadline_ns` of CLOCK_MONOTONIC at the
// latest. No event of the contract: only the profile `ros2` tells it.
void thread_wait(std::int64_t deadline_ns) noexcept;

// On a callback's thread, on return from a wait in which it really waited.
void thread_wakeup(CallbackId callback, WakeupReason reason) noexcept;

// Makes the calling thread's first event now, so that its one-time cost (an allocation, a lock, a
// system call) is not paid on the hot path. Thread's constructor does it; others may call it.
void touch_current_thread() noexcept;

}  // namespace cie::trace
