// Who is who: turns the state events and the contexts of all others into processes, threads,
// callbacks, groups and publishers of the model. Ids, pids and tids are reused by the system; an
// incarnation never is.
#pragma once

#include <cie/analysis/event.hpp>

#include "facts.hpp"
#include "sequence_tracker.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>

namespace cie::analysis {

class Registry {
 public:
  explicit Registry(Model& model) : model_(model) {}

  HostIndex host(std::string_view name);
  void set_stream_host(StreamIndex stream, HostIndex host);
  HostIndex host_of(const EventHead& head) const;

  // The process an event belongs to now; creates a provisional one. Empty without a pid.
  std::optional<ProcessIndex> process_of(const EventHead& head);
  // The same, of an event that makes it a process of the report.
  std::optional<ProcessIndex> speaker_of(const EventHead& head);
  // The thread that emitted the event; creates a provisional, unannounced one. Empty without a tid.
  std::optional<ThreadIndex> thread_of(const EventHead& head);
  // The announced or provisional thread of a kernel tid, if any cie event ever named it.
  std::optional<ThreadIndex> thread_by_tid(HostIndex host, std::int64_t tid) const;
  // The callback, known or provisional (init not seen yet).
  CallbackIndex callback(ProcessIndex process, CallbackId id);
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

  // Publisher by the 64-bit writer gid it announced on any host. Empty if unknown.
  std::optional<std::uint32_t> publisher_by_gid(std::uint64_t gid) const;

  SequenceTracker& starts(CallbackIndex callback) { return start_numbers_[callback]; }
  SequenceTracker& published(std::uint32_t publisher) { return publish_numbers_[publisher]; }
  void finish();

 private:
  struct Key {
    std::uint64_t scope = 0;  // host or process
    std::int64_t id = 0;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct KeyHash {
    std::size_t operator()(const Key& key) const noexcept {
      return std::hash<std::uint64_t>{}(static_cast<std::uint64_t>(key.id) * 0x9e3779b97f4a7c15U ^
                                        key.scope * 0xc2b2ae3d27d4eb4fU);
    }
  };
  template <typename Value>
  using KeyMap = std::unordered_map<Key, Value, KeyHash>;

  ProcessIndex new_process(HostIndex host, std::int64_t pid);
  ThreadIndex new_thread(ProcessIndex process, std::int64_t tid);
  std::optional<ThreadIndex> find_thread(ProcessIndex process, std::int64_t tid) const;
  std::uint32_t group(ProcessIndex process, GroupId id, const EventHead& head);
  std::string node_name(ProcessIndex process, NodeId id) const;

  Model& model_;
  std::vector<HostIndex> stream_hosts_;
  KeyMap<ProcessIndex> process_by_pid_;
  KeyMap<ThreadIndex> thread_by_process_tid_;
  KeyMap<ThreadIndex> thread_by_host_tid_;
  KeyMap<CallbackIndex> callback_by_id_;
  KeyMap<std::uint32_t> publisher_by_id_;
  KeyMap<std::uint32_t> group_by_id_;
  KeyMap<std::uint32_t> node_by_id_;
  std::unordered_map<std::uint64_t, std::uint32_t> publisher_by_gid_;
  std::unordered_map<CallbackIndex, SequenceTracker> start_numbers_;
  std::unordered_map<std::uint32_t, SequenceTracker> publish_numbers_;
  std::unordered_map<ThreadIndex, SequenceTracker> read_back_numbers_;
};

}  // namespace cie::analysis
