// Every live object of this process that state events speak of. It owns their order: `run_begin`
// first, `run_end` last, and an announcement never interleaves with a registration.
#pragma once

#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/trace.hpp>

#include "announcer.hpp"
#include "state.hpp"

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace cie::trace {

// Thread-safe. One per process, created at first use and never destroyed: threads and static
// destructors may outlive everything else at exit.
class Registry {
 public:
  static Registry& instance();

  // Returns the generation that the others want back; it changes with fork().
  std::uint64_t begin_run(const Run& run, ExecutorKind executor, std::string_view spec_sha256);
  void end_run(const Run& run, std::uint64_t generation);
  void set_status(const Run& run, std::uint64_t generation, std::int32_t status) noexcept;

  NodeId add_node(std::string_view name);
  void remove_node(NodeId node);
  GroupId add_group(NodeId node, GroupType type);
  void remove_group(GroupId group);
  std::shared_ptr<CallbackState> add_callback(CallbackInfo info);
  void register_again(CallbackId callback);
  void remove_callback(CallbackId callback);
  std::shared_ptr<PublisherState> add_publisher(NodeId node, std::string_view topic,
                                                std::uint64_t writer_gid,
                                                std::uint32_t queue_depth);
  void remove_publisher(PublisherId publisher);
  std::shared_ptr<ThreadState> add_thread(ThreadState thread);
  void remove_thread(const ThreadState* thread);

  // Numbers, keeps (before a Run) or emits one read-back of a registered thread.
  void record_sched(ThreadState& thread, SchedMoment moment, std::int32_t error,
                    const SchedReadBack& parameters);
  // From the next read-back on, the thread's parameters belong to another change of them.
  void begin_change(ThreadState& thread);
  // What `run_begin` names from now on; emits one with moment announce, and all state.
  void set_spec(std::uint64_t generation, std::string_view spec_sha256);

  std::string unique_logical_id(std::string_view base);

  // Emits all state again, `run_begin` with moment announce first and audits after the threads.
  // Does nothing outside a Run.
  void announce();
  // Emits `clock_sync`. Does nothing outside a Run.
  void sync_clocks();
  // Events of the profile `ros2` are recorded no longer: whoever records them next has to be told
  // everything.
  void forget_ros2_readers();
  // Emits the *_fini of everything live and `run_end`. Nothing is registered or emitted after it.
  void finish_at_exit() noexcept;

 private:
  struct GroupRecord {
    NodeId node{};
    GroupType type{};
  };
  // Everything that a child of fork() must not inherit.
  struct Live {
    std::map<const Run*, std::int32_t> runs;  // with the status of each
    bool is_running = false;                  // between run_begin and run_end
    RunFacts facts;
    RunTotals totals;
    std::map<NodeId, std::string> nodes;  // id -> name
    std::map<GroupId, GroupRecord> groups;
    std::map<CallbackId, std::shared_ptr<CallbackState>> callbacks;
    std::map<PublisherId, std::shared_ptr<PublisherState>> publishers;
    std::vector<std::shared_ptr<ThreadState>> threads;  // in order of registration
    std::set<std::string, std::less<>> logical_ids;  // claimed, and not yet of a callback that went
    std::unique_ptr<Announcer> announcer;
    // Whoever records events of the profile `ros2` was told of all that is live. Readers of that
    // vocabulary take what they are told again for something new.
    bool is_told_to_ros2_readers = false;

    bool has_objects() const noexcept;
  };

  class Guard;

  Registry();

  // All state again, beginning with `run_begin`.
  void emit_announcement() const;
  void emit_registered();
  void emit_everything() const;
  void tell_ros2_readers();
  // Emits run_end if nothing is left; returns what must be stopped once the lock is released.
  std::unique_ptr<Announcer> end_if_empty();

  static void before_fork();
  static void after_fork_in_parent();
  static void after_fork_in_child();

  PriorityMutex mutex_;
  std::unique_ptr<Live> live_;
  std::uint64_t generation_ = 1;
  bool is_finished_ = false;
  std::uint32_t next_node_ = 0;
  std::uint32_t next_group_ = 0;
  std::uint32_t next_callback_ = 0;
  std::uint32_t next_publisher_ = 0;
};

}  // namespace cie::trace
