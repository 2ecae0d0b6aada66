// Who is who: turns the state events and the contexts of all others into processes, threads,
// callbacks, groups and publishers of the model. Ids, pids and tids are reused by the system; an
// incarnation never is.
#pragma once

#include <cie/analysis/event.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/prefetch.hpp"
#include "begun_again.hpp"
#include "flat_map.hpp"
#include "known_emitters.hpp"
#include "model/by_index.hpp"
#include "model/facts.hpp"
#include "sequence_tracker.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

class LossTimes;

// Who emitted an event. Empty without a pid; the thread also without a tid.
struct Emitter {
  HostIndex host{};
  std::optional<ProcessIndex> process;
  std::optional<ThreadIndex> thread;
  // The registry's, until another emitter is looked up; null: it was not looked up before.
  KnownEmitter* known = nullptr;
  // Its last event was on another CPU, or is not known.
  bool is_elsewhere = true;
};

ReadBack read_back_of(const EventHead& head, const ThreadSched& event);

class Registry {
 public:
  // Both are borrowed. `spec` may be null.
  explicit Registry(Model& model, const SchedulingSpec* spec = nullptr)
      : model_(model), spec_(spec), emitters_(model) {}

  // The machine of that name and boot: machines may be called alike, and a boot has one clock. A
  // trace that does not tell its boot is of any machine of that name.
  HostIndex host(std::string_view name, std::string_view clock_uuid);
  void set_stream_host(StreamIndex stream, HostIndex host);
  HostIndex host_of(const EventHead& head) const noexcept {
    const auto* host = stream_hosts_.find(head.stream);
    return host != nullptr ? *host : HostIndex{};
  }

  // An event's emitter will be looked up soon.
  void prefetch(const EventHead& head) const noexcept { emitters_.prefetch(head); }
  // Null: it must be looked up.
  const KnownEmitter* known_emitter_of(const EventHead& head) const noexcept {
    return emitters_.peek(head, host_of(head));
  }
  [[gnu::always_inline]] KnownEmitter* known_emitter_of(const EventHead& head) noexcept {
    return emitters_.peek(head, host_of(head));
  }
  // Once per event; creates provisional incarnations.
  [[gnu::always_inline]] Emitter emitter_of(const EventHead& head) {
    auto* const known = known_emitter_of(head);
    return known == nullptr ? find_emitter(head) : see_again(*known, head.cpu, head.time);
  }
  // Another event of a known emitter.
  [[gnu::always_inline]] Emitter see_again(KnownEmitter& known, ContextNumber<std::int32_t> cpu,
                                           Timestamp time) noexcept {
    const bool is_elsewhere = known.last_cpu != cpu;
    emitters_.see_again(known, cpu, time);
    return {.host = known.host,
            .process = known.process,
            .thread = known.thread,
            .known = &known,
            .is_elsewhere = is_elsewhere};
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
  std::optional<ProcessIndex> reported_process_of(const EventHead& head);
  // It is a process of the report.
  void note_reported(const EventHead& head, ProcessIndex process) {
    note_reported(head, model_.processes[at(process)]);
  }
  static void note_reported(const EventHead& head, ProcessFacts& facts) noexcept {
    facts.is_from_ros2 = head.is_derived && (facts.is_from_ros2 || !facts.has_cie_events);
    facts.has_cie_events = true;
  }
  // Brings the `last_seen` of all threads and processes up to date.
  void note_last_seen() { emitters_.forget_all(); }
  // Of a process, by the tid that it knows it by.
  std::optional<ThreadIndex> find_thread(ProcessIndex process, std::int64_t tid) const;
  // A thread of the process spoke where the kernel's switches have its tid, or where they have
  // another one. What was seen first counts, until one shows that they have it.
  void note_place(ProcessIndex process, bool is_where_switched);
  // The announced or provisional thread of a kernel tid, if any cie event ever named it.
  std::optional<ThreadIndex> thread_by_tid(HostIndex host, std::int64_t tid) const;
  // The thread that has the tid leaves its CPU dead: later events of that tid are another one's.
  void die(const EventHead& head, std::int64_t tid);
  // A thread with the tid was created: whoever had it is gone.
  void give_tid_anew(HostIndex host, std::int64_t tid);
  // The callback, known or provisional (init not seen yet).
  CallbackIndex callback(ProcessIndex process, CallbackId id);
  // The same, if there is one.
  std::optional<CallbackIndex> find_callback(ProcessIndex process, CallbackId id) const {
    const auto* found = callback_by_id_.find({scope(process), key(id)});
    return found != nullptr ? std::optional(*found) : std::nullopt;
  }
  // The same of an emitter with a process: most threads run one callback only.
  [[gnu::always_inline]] CallbackIndex callback(const Emitter& who, CallbackId id) {
    auto* known = who.known;
    if (known != nullptr && known->ran.is(id)) return known->ran.index;
    const auto index = callback(*who.process, id);
    if (known != nullptr) {
      known->ran = {.id = id, .index = index};
      known->ran_facts = &model_.callbacks[at(index)];
    }
    return index;
  }
  // The facts of the callback that the last call named, of the same emitter.
  CallbackFacts& facts_of(const Emitter& who, CallbackIndex callback) {
    return who.known != nullptr ? *who.known->ran_facts : model_.callbacks[at(callback)];
  }
  // Of an emitter with a process.
  ProcessFacts& process_facts_of(const Emitter& who) {
    return who.known != nullptr ? *who.known->process_facts : model_.processes[at(*who.process)];
  }
  // Of an emitter with a thread.
  ThreadFacts& facts_of(const Emitter& who) {
    return who.known != nullptr ? *who.known->thread_facts : model_.threads[at(*who.thread)];
  }
  // The same of one that it releases: within a process who publishes does.
  CallbackIndex released(const Emitter& who, CallbackId id) {
    auto* known = who.known;
    if (known == nullptr) return callback(*who.process, id);
    if (!known->released.is(id)) known->released = {.id = id, .index = callback(*who.process, id)};
    return known->released.index;
  }
  std::uint32_t publisher(ProcessIndex process, PublisherId id);
  // The same of an emitter with a process.
  std::uint32_t publisher(const Emitter& who, PublisherId id) {
    auto* known = who.known;
    if (known == nullptr) return publisher(*who.process, id);
    if (!known->published.is(id))
      known->published = {.id = id, .index = publisher(*who.process, id)};
    return known->published.index;
  }

  // Before its emitter is looked up: if whoever has the pid began at another time, or executes another
  // program, it has it no more.
  void detect_reused_pid(const EventHead& head, const RunBegin& event, const LossTimes& losses);
  // Likewise of what is told of state: an id that was given before the last run_begin is of another
  // program.
  void detect_another_program(const EventHead& head, const EventBody& body);
  bool has_any_ended() const noexcept { return is_any_ended_; }
  // Likewise of any other event: if whoever has the pid has ended and used its number before, it is of
  // another process, whose run_begin was lost. Where it may be of either, that is noted.
  void detect_reused_pid_after_end(const EventHead& head, const EventBody& body,
                                   const LossTimes& losses);
  // Once all was consumed. What no one process tells twice may be of another one, if its run_begin was
  // lost.
  void doubt_told_again(const LossTimes& losses);
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
  std::optional<ThreadIndex> apply(const EventHead& head, const ThreadFini& event);
  // Returns the thread whose parameters were read back.
  std::optional<ThreadIndex> apply(const EventHead& head, const ThreadSched& event);
  void apply(const EventHead& head, const SchedProcessExit& event);
  void apply(const EventHead& head, const SchedProcessExec& event);
  void apply(const EventHead& head, const ProcessName& event);
  void apply(const EventHead& head, const Ros2ProcessBegin& event);
  void apply(const EventHead& head, const ProcessContinued& event);
  void apply(const EventHead& head, const InterleavedInstances& event);
  void apply(const EventHead& head, const Ros2Tracer& event);
  void apply(const EventHead& head, const UntracedEntity& event);
  void apply(const EventHead& head, const UntracedWriter& event);
  void apply(const Emitter& who, const UntracedInstance& event);
  // Of a thread that runs nothing that its process's own events tell of.
  void apply(const EventHead& head, const ForeignInstance& event);
  void apply(const EventHead& head, const ForeignCallback& event);

  // Publisher by the 64-bit writer gid it announced: the one of the reader's host, else of any
  // (machines that are copies of each other may give equal ones). Empty if unknown.
  std::optional<std::uint32_t> publisher_by_gid(HostIndex reader, std::uint64_t gid) const;
  // Of the callback's group, as far as that is told.
  std::optional<GroupType> group_type_of(const CallbackFacts& callback) const;
  // How many told their gids: while no other one does, a gid is of the same publisher.
  std::uint32_t publishers_told() const noexcept { return publishers_told_; }
  // One did since then, or then.
  bool is_publisher_told_since(Timestamp time) const noexcept {
    return last_publisher_told_ >= time;
  }
  // Some of those that published may yet do: their processes announce within one second of a
  // session's start; three are ample.
  static constexpr Duration kAnnouncedWithin{3'000'000'000};
  bool awaits_publishers(Timestamp now) const noexcept {
    return awaited_publishers_ > 0 && now - last_awaited_ <= kAnnouncedWithin;
  }

  // It will publish soon, as it did last, and release what it released then.
  void prefetch_publication(const KnownEmitter& publisher) const noexcept {
    if (publisher.published.is_any()) {
      const auto& facts = model_.publishers[publisher.published.index];
      prefetch_lines(&facts, &facts.published.first);
    }
    if (publisher.released.is_any()) {
      const auto& facts = model_.callbacks[at(publisher.released.index)];
      prefetch_head(&facts);
      prefetch_head(&facts.starts);
      prefetch_head(&facts.releases);
    }
  }
  // The callback will run soon.
  void prefetch_numbers(CallbackIndex callback) const noexcept {
    prefetch_head(start_numbers_.find(callback));
    prefetch_head(end_numbers_.find(callback));
  }
  SequenceTracker& starts(CallbackIndex callback) { return start_numbers_[callback]; }
  SequenceTracker& ends(CallbackIndex callback) { return end_numbers_[callback]; }
  // Facts of a callback that an instance of that number begins and ends.
  void note_start(std::uint64_t seq, const EventRef& where, CallbackIndex callback,
                  SequenceFacts& starts) {
    if (SequenceTracker::observe_next(seq, where, starts)) return;
    note_other_start(seq, where, callback, starts);
  }
  // A start in the window, of a number that those before the window show to be another process's.
  void note_start_again(std::uint64_t seq, const EventRef& where, CallbackIndex callback,
                        const SequenceTracker& before, const SequenceFacts& seen) {
    if (is_of_another(seq, callback, before, seen))
      note_told_again(model_.callbacks[at(callback)].process, where);
  }
  void note_end(std::uint64_t seq, const EventRef& where, CallbackIndex callback,
                SequenceFacts& ends) {
    if (SequenceTracker::observe_next(seq, where, ends)) return;
    end_numbers_[callback].observe(seq, where, ends);
  }
  SequenceTracker& published(std::uint32_t publisher) { return publish_numbers_[publisher]; }
  // Facts of a publisher that a message of that number is of. False: messages before it are missing.
  bool note_publication(std::uint64_t seq, const EventRef& where, std::uint32_t publisher,
                        PublisherFacts& facts) {
    // Nobody announces those that follow from other events: they are told before what they publish.
    if (!facts.registered && facts.is_accounted && !facts.awaited_since) [[unlikely]] {
      facts.awaited_since = where.time;
      ++awaited_publishers_;
      last_awaited_ = where.time;
    }
    const auto& last = facts.published.last;
    const bool follows = !last || facts.published.is_restarted || seq <= *last + 1;
    published(publisher).observe(seq, where, facts.published);
    return follows;
  }
  SequenceTracker& read_backs(ThreadIndex thread) { return read_back_numbers_[thread]; }
  void finish();

 private:
  // Not the number after the last one.
  void note_other_start(std::uint64_t seq, const EventRef& where, CallbackIndex callback,
                        SequenceFacts& starts);
  // What it told was another one's, which began then.
  bool has_run_since(ProcessIndex process, Timestamp start) const;
  // No one process tells of a start with that number after those.
  bool is_of_another(std::uint64_t seq, CallbackIndex callback, const SequenceTracker& numbers,
                     const SequenceFacts& seen) const;
  // No one process tells that twice, or in that order.
  void note_told_again(ProcessIndex process, const EventRef& where);
  // The same of a node, a group or a publisher: each is told once, when it is made, and again to sessions
  // that attach.
  void note_made_again(const EventHead& head, ProcessIndex process);
  // A callback of the same id in the same process would be told alike.
  bool is_of_another(const CallbackInit& event, const CallbackFacts& facts,
                     bool is_announcement) const;
  struct Key {
    std::uint64_t scope = 0;  // host or process
    std::int64_t id = 0;
    friend bool operator==(const Key&, const Key&) = default;
    // Ids are given in turn, as tids are.
    friend Key group_of(const Key& key) noexcept { return {key.scope, analysis::group_of(key.id)}; }
    friend std::size_t within_group(const Key& key) noexcept {
      return analysis::within_group(key.id);
    }
  };
  struct KeyHash {
    std::uint64_t operator()(const Key& key) const noexcept {
      return SpreadBits{}(key.id) + key.scope * 0xc2b2ae3d27d4eb4fU;
    }
  };
  template <typename Value>
  using IdMap = NearMap<Key, Value, KeyHash>;
  template <typename Index>
  static std::uint64_t scope(Index index) noexcept {
    return static_cast<std::uint64_t>(index);
  }
  template <typename Id>
  static std::int64_t key(Id id) noexcept {
    return static_cast<std::int64_t>(to_number(id));
  }

  void note_begun_again(ProcessIndex index, const EventHead& head, const RunBegin& event);
  bool is_given_before(ProcessIndex process, const BegunAgain& begun, const EventBody& body) const;
  void begin_another_program(ProcessIndex former, const BegunAgain& begun);
  // A process has the pid of the former one now.
  void pass_name_on(ProcessIndex former, ProcessIndex index);
  Emitter find_emitter(const EventHead& head);
  // Who had the event's pid last, if its run ended before.
  std::optional<ProcessIndex> ended_holder_of_pid(const EventHead& head) const;
  bool has_used_number_of(ProcessIndex process, const EventBody& body) const;
  // After what has_tids_of_kernel() says of the process has changed.
  void set_known_to_kernel(ProcessIndex process);
  void note_exit(const EventHead& head, ThreadIndex thread, std::string_view event);
  // Another process has the pid of whoever has it.
  void note_sharing(const EventHead& head, PidSharing sharing);
  // Instances of it may be told as another's from here on, or the other way round.
  void note_shared_address(const EventHead& head, CallbackIndex callback);
  Emitter find_runner(const EventHead& head, const Emitter& who);
  void tell_namesakes_apart(std::string_view name);
  ProcessIndex new_process(HostIndex host, std::int64_t pid);
  void note_trace(const EventHead& head, ProcessFacts& process) const;
  ThreadIndex new_thread(ProcessIndex process, std::int64_t tid);
  std::uint32_t group(ProcessIndex process, GroupId id, const EventHead& head);
  std::string node_name(ProcessIndex process, NodeId id) const;

  Model& model_;
  const SchedulingSpec* spec_;
  ByIndex<StreamIndex, HostIndex> stream_hosts_;
  KnownEmitters emitters_;
  IdMap<ProcessIndex> process_by_pid_;
  IdMap<ThreadIndex> thread_by_process_tid_;
  IdMap<std::optional<ThreadIndex>> thread_by_host_tid_;  // empty: of none that is known
  IdMap<CallbackIndex> callback_by_id_;
  IdMap<std::uint32_t> publisher_by_id_;
  IdMap<std::uint32_t> group_by_id_;
  IdMap<std::uint32_t> node_by_id_;
  FlatMap<std::uint64_t, std::uint32_t> publisher_by_gid_;      // of any host
  FlatMap<Key, std::uint32_t, KeyHash> publisher_by_host_gid_;  // gids are not near each other
  std::map<ProcessIndex, BegunAgain> begun_again_;
  // What a process was called until it was named after its run_begin. Names are told before programs
  // begin, and by sessions that attach: who has the pid next may be meant.
  std::map<ProcessIndex, std::string> names_before_;
  std::uint32_t publishers_told_ = 0;
  Timestamp last_publisher_told_ = kEarliest;
  std::uint32_t awaited_publishers_ = 0;  // those with awaited_since
  Timestamp last_awaited_;                // the latest of these times
  bool is_any_ended_ = false;             // by a run_end
  ByIndex<CallbackIndex, SequenceTracker> start_numbers_;
  ByIndex<CallbackIndex, SequenceTracker> end_numbers_;
  ByIndex<std::uint32_t, SequenceTracker> publish_numbers_;
  ByIndex<ThreadIndex, SequenceTracker> read_back_numbers_;
};

}  // namespace cie::analysis
