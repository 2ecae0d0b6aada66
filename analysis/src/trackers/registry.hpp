// Who is who: turns the state events and the contexts of all others into processes, threads,
// callbacks, groups and publishers of the model. Ids, pids and tids are reused by the system; an
// incarnation never is.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "flat_map.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "sequence_tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

// Who emitted an event. Empty without a pid; the thread also without a tid.
struct Emitter {
  std::optional<ProcessIndex> process;
  std::optional<ThreadIndex> thread;
  struct Known;
  // The registry's, until another emitter is looked up; null: it was not looked up before.
  Known* known = nullptr;
};

// What the last events said of an emitter, in place of look-ups in three tables for every event.
struct Emitter::Known {
  ThreadFacts* thread_facts = nullptr;  // null: nothing
  HostIndex host{};
  ProcessIndex process{};
  ThreadIndex thread{};
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  // Its last event, not yet in its facts and its process's; and which of all it was.
  Timestamp last_time;
  std::optional<std::int32_t> last_cpu;
  std::uint64_t last_turn = 0;
  CallbackId callback_id{};
  std::optional<CallbackIndex> callback;  // what it ran last, by that id
  CallbackFacts* callback_facts = nullptr;

  bool is_of(const EventHead& head, HostIndex of_host) const noexcept {
    return thread_facts != nullptr && head.tid == tid && head.pid == pid && host == of_host;
  }
  EventRef last_seen() const noexcept {
    return {.time = last_time, .cpu = last_cpu, .pid = pid, .tid = tid};
  }
};

ReadBack read_back_of(const EventHead& head, const ThreadSched& event);

class Registry {
 public:
  // Both are borrowed. `spec` may be null.
  explicit Registry(Model& model, const SchedulingSpec* spec = nullptr)
      : model_(model), spec_(spec) {}

  // The machine of that name and boot: machines may be called alike, and a boot has one clock. A
  // trace that does not tell its boot is of any machine of that name.
  HostIndex host(std::string_view name, std::string_view clock_uuid);
  void set_stream_host(StreamIndex stream, HostIndex host);
  HostIndex host_of(const EventHead& head) const noexcept {
    return at(head.stream) < stream_hosts_.size() ? stream_hosts_[at(head.stream)] : HostIndex{};
  }

  // Once per event; creates provisional incarnations.
  Emitter emitter_of(const EventHead& head) {
    auto& known = emitters_[emitter_place(head)];
    if (!known.is_of(head, host_of(head))) return find_emitter(head);
    known.last_time = head.time;
    known.last_cpu = head.cpu;
    known.last_turn = ++turn_;
    return {.process = known.process, .thread = known.thread, .known = &known};
  }
  // The same of a callback's start. A thread may publish after its `thread_fini`, but runs no
  // callback: one that starts there, unless a `thread_init` came since, is on an unknown thread.
  Emitter runner_of(const EventHead& head, const Emitter& who) {
    if (who.known == nullptr || !who.known->thread_facts->fini) return who;
    return find_runner(head, who);
  }
  // The process an event belongs to now; creates a provisional one. Empty without a pid.
  std::optional<ProcessIndex> process_of(const EventHead& head);
  // The same, of an event that makes it a process of the report.
  std::optional<ProcessIndex> speaker_of(const EventHead& head);
  // It did more than keep the time: it is a process of the report.
  void note_speaker(const EventHead& head, ProcessIndex process) {
    auto& facts = model_.processes[at(process)];
    facts.is_told_by_ros2 = head.is_derived && (facts.is_told_by_ros2 || !facts.has_cie_events);
    facts.has_cie_events = true;
  }
  // The announced or provisional thread of a kernel tid, if any cie event ever named it.
  std::optional<ThreadIndex> thread_by_tid(HostIndex host, std::int64_t tid) const;
  // The callback, known or provisional (init not seen yet).
  CallbackIndex callback(ProcessIndex process, CallbackId id);
  // The same of an emitter with a process: most threads run one callback only.
  CallbackIndex callback(const Emitter& who, CallbackId id) {
    auto* known = who.known;
    if (known != nullptr && known->callback && known->callback_id == id) return *known->callback;
    const auto index = callback(*who.process, id);
    if (known != nullptr) {
      known->callback = index;
      known->callback_facts = &model_.callbacks[at(index)];
      known->callback_id = id;
    }
    return index;
  }
  std::uint32_t publisher(ProcessIndex process, PublisherId id);

  void apply(const EventHead& head, const RunBegin& event);
  void apply(const EventHead& head, const RunEnd& event);
  void apply(const EventHead& head, const NodeInit& event);
  void apply(const EventHead& head, const GroupInit& event);
  void apply(const EventHead& head, const CallbackInit& event);
  void apply(const EventHead& head, const CallbackFini& event);
  void apply(const EventHead& head, const PublisherInit& event);
  void apply(const EventHead& head, const PublisherFini& event);
  // Returns the incarnation that the event announces (again).
  std::optional<ThreadIndex> apply(const EventHead& head, const ThreadInit& event);
  void apply(const EventHead& head, const ThreadFini& event);
  // Returns the thread whose parameters were read back.
  std::optional<ThreadIndex> apply(const EventHead& head, const ThreadSched& event);
  void apply(const EventHead& head, const SchedProcessExit& event);
  void apply(const EventHead& head, const ProcessName& event);
  void apply(const EventHead& head, const Ros2Begin& event);
  void apply(const EventHead& head, const Ros2Tracer& event);
  void apply(const EventHead& head, const HiddenInit& event);
  void apply(const Emitter& who, const HiddenRun& event);

  // Publisher by the 64-bit writer gid it announced: the one of the reader's host, else of any
  // (machines that are copies of each other may give equal ones). Empty if unknown.
  std::optional<std::uint32_t> publisher_by_gid(HostIndex reader, std::uint64_t gid) const;

  SequenceTracker& starts(CallbackIndex callback) { return start_numbers_[callback]; }
  SequenceTracker& ends(CallbackIndex callback) { return end_numbers_[callback]; }
  SequenceTracker& published(std::uint32_t publisher) { return publish_numbers_[publisher]; }
  void finish();

 private:
  struct Key {
    std::uint64_t scope = 0;  // host or process
    std::int64_t id = 0;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    std::uint64_t operator()(const Key& key) const noexcept {
      return SpreadBits{}(key.id) + key.scope * 0xc2b2ae3d27d4eb4fU;
    }
  };
  template <typename Value>
  using KeyMap = FlatMap<Key, Value, KeyHash>;

  // Powers of two. There are twice as many places as threads, as long as that is not too many.
  static constexpr std::size_t kFewestEmitters = 512;
  static constexpr std::size_t kMostEmitters = std::size_t{1} << 16U;

  // Threads of one process have tids close to each other: they do not meet in one place.
  std::size_t emitter_place(const EventHead& head) const noexcept {
    const auto mixed = static_cast<std::uint64_t>(head.tid.value_or(0)) +
                       (SpreadBits{}(head.pid.value_or(0)) >> 32U);
    return mixed & (emitters_.size() - 1);
  }
  Emitter find_emitter(const EventHead& head);
  Emitter find_runner(const EventHead& head, const Emitter& who);
  void forget(Emitter::Known& known);
  void note_last_seen(ProcessIndex process, const EventRef& event, std::uint64_t turn);
  // Before an incarnation is replaced by another one, or what is known of them is read.
  void forget_emitters();
  void tell_namesakes_apart(std::string_view name);
  ProcessIndex new_process(HostIndex host, std::int64_t pid);
  ThreadIndex new_thread(ProcessIndex process, std::int64_t tid);
  std::optional<ThreadIndex> find_thread(ProcessIndex process, std::int64_t tid) const;
  std::uint32_t group(ProcessIndex process, GroupId id, const EventHead& head);
  std::string node_name(ProcessIndex process, NodeId id) const;

  Model& model_;
  const SchedulingSpec* spec_;
  std::vector<HostIndex> stream_hosts_;
  std::vector<Emitter::Known> emitters_ = std::vector<Emitter::Known>(kFewestEmitters);
  std::uint64_t turn_ = 0;                              // of events, counted up
  ByIndex<ProcessIndex, std::uint64_t> process_turns_;  // of the event that is its last_seen
  KeyMap<ProcessIndex> process_by_pid_;
  KeyMap<ThreadIndex> thread_by_process_tid_;
  KeyMap<ThreadIndex> thread_by_host_tid_;
  KeyMap<CallbackIndex> callback_by_id_;
  KeyMap<std::uint32_t> publisher_by_id_;
  KeyMap<std::uint32_t> group_by_id_;
  KeyMap<std::uint32_t> node_by_id_;
  FlatMap<std::uint64_t, std::uint32_t> publisher_by_gid_;  // of any host
  KeyMap<std::uint32_t> publisher_by_host_gid_;
  ByIndex<CallbackIndex, SequenceTracker> start_numbers_;
  ByIndex<CallbackIndex, SequenceTracker> end_numbers_;
  ByIndex<std::uint32_t, SequenceTracker> publish_numbers_;
  ByIndex<ThreadIndex, SequenceTracker> read_back_numbers_;
};

}  // namespace cie::analysis
