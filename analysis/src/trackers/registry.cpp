#include "registry.hpp"

#include <cie/analysis/deadline.hpp>

#include <algorithm>

namespace cie::analysis {
namespace {

template <typename Index>
std::uint64_t scope(Index index) noexcept {
  return static_cast<std::uint64_t>(index);
}

// Its tid may be another one's by now.
bool is_gone(const ThreadFacts& thread) {
  return thread.kernel_exit.has_value() || thread.is_tid_given_anew;
}

template <typename Id>
std::int64_t key(Id id) noexcept {
  return static_cast<std::int64_t>(to_number(id));
}

}  // namespace

ReadBack read_back_of(const EventHead& head, const ThreadSched& event) {
  ReadBack read{.at = ref(head),
                .moment = event.moment,
                .n = event.n,
                .policy = event.policy,
                .flags = event.flags,
                .nice = event.nice,
                .priority = event.priority,
                .runtime_ns = event.runtime_ns,
                .deadline_ns = event.deadline_ns,
                .period_ns = event.period_ns,
                .cpus = {event.cpus.begin(), event.cpus.end()},
                .error = event.error,
                .slice_ns = event.slice_ns,
                .util_min = event.util_min,
                .util_max = event.util_max,
                .change = event.change,
                .starts_before = 0};
  std::ranges::sort(read.cpus);  // most often they are
  return read;
}

HostIndex Registry::host(std::string_view name, std::string_view clock_uuid) {
  bool has_namesake = false;
  for (std::size_t i = 0; i < model_.hosts.size(); ++i) {
    auto& known = model_.hosts[i];
    if (known.told != name) continue;
    const bool is_other_boot = !name.empty() && !clock_uuid.empty() && !known.clock_uuid.empty() &&
                               known.clock_uuid != clock_uuid;
    if (!is_other_boot) {
      if (known.clock_uuid.empty()) known.clock_uuid = clock_uuid;
      return HostIndex{static_cast<std::uint32_t>(i)};
    }
    has_namesake = true;
  }
  model_.hosts.push_back(HostFacts{
      .name = std::string(name), .told = std::string(name), .clock_uuid = std::string(clock_uuid)});
  if (has_namesake) tell_namesakes_apart(name);
  return HostIndex{static_cast<std::uint32_t>(model_.hosts.size() - 1)};
}

void Registry::tell_namesakes_apart(std::string_view name) {
  constexpr std::size_t kTelling = 8;  // of 32 digits
  for (auto& host : model_.hosts) {
    if (host.told == name)
      host.name = host.told + " (boot " + host.clock_uuid.substr(0, kTelling) + ')';
  }
}

void Registry::set_stream_host(StreamIndex stream, HostIndex host) { stream_hosts_[stream] = host; }

ProcessIndex Registry::new_process(HostIndex host, std::int64_t pid) {
  emitters_.forget_all();
  const auto index = ProcessIndex{static_cast<std::uint32_t>(model_.processes.size())};
  auto& process = model_.processes.emplace_back();
  process.host = host;
  process.pid = pid;
  process_by_pid_[{scope(host), pid}] = index;
  return index;
}

std::optional<ProcessIndex> Registry::process_of(const EventHead& head) {
  if (!head.pid) return std::nullopt;
  const auto host = host_of(head);
  const auto* found = process_by_pid_.find({scope(host), *head.pid});
  const auto index = found != nullptr ? *found : new_process(host, *head.pid);
  auto& process = model_.processes[at(index)];
  if (!process.first_seen) process.first_seen = ref(head);
  emitters_.process_seen(index, ref(head));
  return index;
}

std::optional<ProcessIndex> Registry::speaker_of(const EventHead& head) {
  const auto process = process_of(head);
  if (process) note_speaker(head, *process);
  return process;
}

ThreadIndex Registry::new_thread(ProcessIndex process, std::int64_t tid) {
  emitters_.forget(model_.processes[at(process)].pid, tid);
  const auto index = ThreadIndex{static_cast<std::uint32_t>(model_.threads.size())};
  auto& thread = model_.threads.emplace_back();
  thread.process = process;
  thread.tid = tid;
  thread.is_known_to_kernel = has_tids_of_kernel(model_.processes[at(process)]);
  thread_by_process_tid_[{scope(process), tid}] = index;
  if (thread.is_known_to_kernel) {
    thread_by_host_tid_[{scope(model_.processes[at(process)].host), tid}] = index;
  }
  return index;
}

void Registry::hide_from_kernel(ProcessIndex process) {
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    if (thread.process != process) continue;
    thread.is_known_to_kernel = false;
    auto* const holder =
        thread_by_host_tid_.find({scope(model_.processes[at(process)].host), thread.tid});
    if (holder != nullptr && *holder == ThreadIndex{static_cast<std::uint32_t>(i)}) holder->reset();
  }
}

std::optional<ThreadIndex> Registry::find_thread(ProcessIndex process, std::int64_t tid) const {
  const auto* found = thread_by_process_tid_.find({scope(process), tid});
  return found != nullptr ? std::optional(*found) : std::nullopt;
}

Emitter Registry::find_emitter(const EventHead& head) {
  const auto host = host_of(head);
  const auto process = process_of(head);
  if (!process || !head.tid) return {.host = host, .process = process, .thread = std::nullopt};
  auto index = find_thread(*process, *head.tid);
  // After its exit a tid belongs to somebody new; after thread_fini alone it may still publish.
  if (!index || is_gone(model_.threads[at(*index)])) index = new_thread(*process, *head.tid);
  auto& thread = model_.threads[at(*index)];
  if (!thread.first_seen) thread.first_seen = ref(head);
  auto& known = emitters_.keep(head, host, *process, *index);
  return {.host = host, .process = process, .thread = index, .known = &known};
}

Emitter Registry::find_runner(const EventHead& head, const Emitter& who) {
  const auto fini = *who.known->thread_facts->fini;
  // Of one nanosecond, in several streams, either may have come first.
  if (head.time <= fini.time) return who;
  const auto index = new_thread(*who.process, *head.tid);
  model_.threads[at(index)].former_fini = fini;
  return emitter_of(head);
}

std::optional<ThreadIndex> Registry::thread_by_tid(HostIndex host, std::int64_t tid) const {
  const auto* found = thread_by_host_tid_.find({scope(host), tid});
  return found != nullptr ? *found : std::nullopt;
}

void Registry::die(const EventHead& head, std::int64_t tid) {
  auto* const found = thread_by_host_tid_.find({scope(host_of(head)), tid});
  if (found == nullptr || !*found) return;
  note_exit(head, **found, SchedSwitch::kName);
  found->reset();
}

void Registry::give_tid_anew(HostIndex host, std::int64_t tid) {
  auto* const found = thread_by_host_tid_.find({scope(host), tid});
  if (found == nullptr || !*found) return;
  emitters_.forget_all();
  model_.threads[at(**found)].is_tid_given_anew = true;
  found->reset();
}

void Registry::note_exit(const EventHead& head, ThreadIndex thread, std::string_view event) {
  emitters_.forget_all();
  auto& facts = model_.threads[at(thread)];
  if (facts.kernel_exit) return;  // a thread exits once: this is of whoever has its tid now
  facts.kernel_exit = ref(head);
  facts.kernel_exit_event = event;
}

CallbackIndex Registry::callback(ProcessIndex process, CallbackId id) {
  const auto [index, is_new] = callback_by_id_.insert({scope(process), key(id)});
  if (is_new) {
    *index = CallbackIndex{static_cast<std::uint32_t>(model_.callbacks.size())};
    auto& callback = model_.callbacks.emplace_back();
    callback.process = process;
    callback.id = id;
    callback.logical_id = "?" + std::to_string(to_number(id));
  }
  return *index;
}

std::uint32_t Registry::publisher(ProcessIndex process, PublisherId id) {
  const auto [index, is_new] = publisher_by_id_.insert({scope(process), key(id)});
  if (is_new) {
    *index = static_cast<std::uint32_t>(model_.publishers.size());
    auto& publisher = model_.publishers.emplace_back();
    publisher.process = process;
    publisher.id = id;
  }
  return *index;
}

std::uint32_t Registry::group(ProcessIndex process, GroupId id, const EventHead& head) {
  const auto [index, is_new] = group_by_id_.insert({scope(process), key(id)});
  if (is_new) {
    *index = static_cast<std::uint32_t>(model_.groups.size());
    auto& group = model_.groups.emplace_back();
    group.process = process;
    group.id = id;
    group.first_seen = ref(head);
  }
  return *index;
}

std::string Registry::node_name(ProcessIndex process, NodeId id) const {
  const auto* found = node_by_id_.find({scope(process), key(id)});
  return found == nullptr ? std::string{} : model_.nodes[*found].name;
}

void Registry::apply(const EventHead& head, const RunBegin& event) {
  auto of_process = head;
  if (!of_process.pid) of_process.pid = event.pid;
  auto index = *process_of(of_process);
  const bool is_pid_own = event.pid == *of_process.pid;
  const auto is_of = [&](const ProcessFacts& process) {
    // Two that begin in one tick of the kernel's clock have the same start.
    return process.start_ns == event.process_start_ns && process.pid_ns == event.pid_ns &&
           process.is_pid_own == is_pid_own;
  };
  if (model_.processes[at(index)].start_ns && !is_of(model_.processes[at(index)])) {
    const auto former = index;
    index = new_process(host_of(head), *of_process.pid);
    auto& before = model_.processes[at(former)];
    auto& process = model_.processes[at(index)];
    process.first_seen = process.last_seen = ref(head);
    if (!before.run_end && (!before.is_pid_own || !is_pid_own || before.pid_ns != event.pid_ns)) {
      before.shares_pid_since = process.shares_pid_since = ref(head);
    }
  }
  auto& process = model_.processes[at(index)];
  note_speaker(head, index);
  process.executor = event.executor;
  if (event.moment == RunMoment::announce) ++process.announcements;
  if (event.moment == RunMoment::start) process.run_end.reset();  // it runs again, to another end
  if (!event.spec_sha256.empty() && event.spec_sha256 != process.spec_sha256) {
    if (process.run_begin) process.spec_since = head.time;
    process.spec_sha256 = event.spec_sha256;
  }
  if (process.run_begin) return;
  process.run_begin = ref(head);
  process.first_spec_sha256 = event.spec_sha256;
  process.first_moment = event.moment;
  process.boot_id = event.boot_id;
  process.tool_version = event.tool_version;
  process.start_ns = event.process_start_ns;
  process.pid_ns = event.pid_ns;
  if (!has_tids_of_kernel(process)) hide_from_kernel(index);
  process.is_pid_own = is_pid_own;
  process.contract_version = event.contract_version;
  process.online_cpus = event.online_cpus;
}

void Registry::apply(const EventHead& head, const RunEnd& event) {
  const auto index = speaker_of(head);
  if (!index) return;
  auto& process = model_.processes[at(*index)];
  process.run_end = RunTotals{.at = ref(head),
                              .callbacks = event.callbacks,
                              .threads = event.threads,
                              .groups = event.groups,
                              .publishers = event.publishers,
                              .status = event.status};
}

void Registry::apply(const EventHead& head, const NodeInit& event) {
  const auto process = speaker_of(head);
  if (!process) return;
  const auto [index, is_new] = node_by_id_.insert({scope(*process), key(event.node)});
  if (is_new) {
    *index = static_cast<std::uint32_t>(model_.nodes.size());
    model_.nodes.push_back(
        NodeFacts{.process = *process, .id = event.node, .name = std::string(event.name)});
  }
}

void Registry::apply(const EventHead& head, const GroupInit& event) {
  const auto process = speaker_of(head);
  if (!process) return;
  auto& facts = model_.groups[group(*process, event.group, head)];
  facts.node = event.node;
  facts.type = event.type;
}

bool Registry::is_of_another(const CallbackInit& event, const CallbackFacts& facts) {
  if (!facts.is_accounted || !facts.is_identified || !event.is_identified) return false;
  return event.logical_id != facts.logical_id || event.kind != facts.kind ||
         event.source != facts.source || event.period_ns != facts.period_ns;
}

void Registry::apply(const EventHead& head, const CallbackInit& event) {
  const auto process = speaker_of(head);
  if (!process) return;
  const auto index = callback(*process, event.callback);
  auto& facts = model_.callbacks[at(index)];
  ++facts.inits;
  // Repeated state follows a run_begin(announce), also of what was not seen to be registered; an init
  // without one registers the callback anew.
  const auto announcements = model_.processes[at(*process)].announcements;
  const bool is_announcement = announcements != facts.announcements_at_init;
  facts.announcements_at_init = announcements;
  if (!is_announcement) facts.last_init = ref(head);
  if (facts.registered) {
    // Ids are given once: another process has this pid, and its run_begin was not seen.
    auto& of = model_.processes[at(*process)];
    if (!of.shares_pid_since && is_of_another(event, facts)) {
      of.shares_pid_since = ref(head);
      of.is_sharing_begin_lost = true;
    }
    return;
  }
  facts.registered = ref(head);
  facts.first_next_seq = event.next_seq;
  facts.is_accounted = !head.is_derived;
  facts.is_identified = event.is_identified;
  facts.logical_id = event.logical_id;
  facts.node_id = event.node;
  facts.node = node_name(*process, event.node);
  facts.kind = event.kind;
  facts.source = event.source;
  facts.symbol = event.symbol;
  facts.period_ns = event.period_ns;
  facts.queue_depth = event.queue_depth;
  facts.deadline_ns = event.deadline_ns;
  facts.response_deadline =
      response_deadline(spec_ == nullptr || !facts.is_identified
                            ? nullptr
                            : spec_->find_callback(facts.logical_id, facts.period_ns),
                        event.deadline_ns);
  facts.first_expiry = event.first_expiry;
  if (to_number(event.group) != kNoId) {
    facts.group = event.group;
    model_.groups[group(*process, event.group, head)].callbacks.push_back(index);
  }
}

void Registry::apply(const EventHead& head, const CallbackFini& event) {
  const auto process = process_of(head);
  if (!process) return;
  model_.callbacks[at(callback(*process, event.callback))].fini =
      CallbackTotals{.at = ref(head),
                     .started = event.started,
                     .ended = event.ended,
                     .released = event.released,
                     .overwritten = event.overwritten,
                     .lost = event.lost};
}

void Registry::apply(const EventHead& head, const PublisherInit& event) {
  const auto process = speaker_of(head);
  if (!process) return;
  const auto index = publisher(*process, event.publisher);
  auto& facts = model_.publishers[index];
  if (facts.registered) return;
  facts.registered = ref(head);
  facts.first_next_seq = event.next_seq;
  facts.topic = event.topic;
  facts.writer_gid = event.writer_gid;
  facts.node = event.node;
  facts.is_accounted = !head.is_derived;
  ++publishers_told_;
  publisher_by_gid_[event.writer_gid] = index;
  const auto host = model_.processes[at(*process)].host;
  publisher_by_host_gid_[{scope(host), static_cast<std::int64_t>(event.writer_gid)}] = index;
}

void Registry::apply(const EventHead& head, const PublisherFini& event) {
  const auto process = process_of(head);
  if (!process) return;
  model_.publishers[publisher(*process, event.publisher)].fini = {ref(head), event.published};
}

std::optional<ThreadIndex> Registry::apply(const EventHead& head, const ThreadInit& event) {
  const auto process = speaker_of(head);
  if (!process) return std::nullopt;
  auto index = find_thread(*process, event.tid);
  if (index) {
    const auto& known = model_.threads[at(*index)];
    const bool is_same_creation = known.start_ns && *known.start_ns == event.start_ns;
    const bool was_unannounced = !known.announced && !is_gone(known) &&
                                 (!known.first_seen || event.start_ns <= known.first_seen->time.ns);
    if (!is_same_creation && !was_unannounced) index.reset();
  }
  if (!index) index = new_thread(*process, event.tid);
  auto& thread = model_.threads[at(*index)];
  if (thread.fini) {  // announced anew after its end: another spin on the same thread
    thread.fini.reset();
    thread.announced_again = head.time;
    thread.last_change = 0;
    SequenceTracker::restart(thread.read_backs);
  }
  if (!thread.announced) {
    thread.announced = ref(head);
    thread.start_ns = event.start_ns;
  }
  thread.role = event.role;
  if (event.callback != kNoCallback) thread.callback = event.callback;
  if (event.group != kNoGroup) thread.group = event.group;
  thread.name = event.name;
  if (head.tid && *head.tid == thread.tid) {
    if (!thread.first_seen) thread.first_seen = ref(head);
    thread.last_seen = ref(head);
  }
  return index;
}

void Registry::apply(const EventHead& head, const ThreadFini& event) {
  const auto process = process_of(head);
  if (!process) return;
  const auto index = find_thread(*process, event.tid);
  if (!index) return;
  auto& thread = model_.threads[at(*index)];
  thread.fini = ref(head);
  thread.fini_read_backs += event.read_backs;
}

std::optional<ThreadIndex> Registry::apply(const EventHead& head, const ThreadSched& event) {
  const auto process = process_of(head);
  if (!process) return std::nullopt;
  auto index = find_thread(*process, event.tid);
  if (!index) index = new_thread(*process, event.tid);
  auto& thread = model_.threads[at(*index)];
  auto read_back = read_back_of(head, event);
  for (const auto* pair : thread.ran)
    read_back.starts_before += pair->starts;
  read_back_numbers_[*index].observe(event.n, read_back.at, thread.read_backs);
  if (event.moment == SchedMoment::initial && !thread.initial) thread.initial = read_back;
  if (event.moment == SchedMoment::applied) {
    note_applied(thread, read_back);
  }
  if (event.moment == SchedMoment::audit) {
    thread.audits = thread.audits.value_or(0) + 1;
    if (!thread.first_audit) thread.first_audit = read_back;
  }
  thread.last_change = std::max(thread.last_change, event.change);
  const bool is_last = !thread.last_read_back || !is_older(read_back, *thread.last_read_back);
  if (is_last) thread.last_read_back = std::move(read_back);
  return index;
}

void Registry::apply(const EventHead& head, const SchedProcessExit& event) {
  if (const auto index = thread_by_tid(host_of(head), event.tid))
    note_exit(head, *index, SchedProcessExit::kName);
}

void Registry::apply(const EventHead& head, const ProcessName& event) {
  const auto process = process_of(head);
  if (!process) return;
  auto& name = model_.processes[at(*process)].name;
  if (!head.is_derived || name.empty()) name = event.name;
  if (!head.is_derived) return;
  // What follows from an event's context is what its thread is called.
  const auto thread = emitter_of(head).thread;
  if (thread && model_.threads[at(*thread)].name.empty()) {
    model_.threads[at(*thread)].name = event.name;
  }
}

std::optional<std::uint32_t> Registry::publisher_by_gid(HostIndex reader, std::uint64_t gid) const {
  const auto* found = publisher_by_host_gid_.find({scope(reader), static_cast<std::int64_t>(gid)});
  if (found == nullptr) found = publisher_by_gid_.find(gid);
  return found != nullptr ? std::optional(*found) : std::nullopt;
}

void Registry::finish() {
  emitters_.forget_all();
  for (std::size_t i = 0; i < model_.callbacks.size(); ++i) {
    auto& facts = model_.callbacks[i];
    const auto& numbers = start_numbers_[CallbackIndex{static_cast<std::uint32_t>(i)}];
    if (facts.registered) {
      numbers.finish(facts.first_next_seq, *facts.registered, facts.starts);
    } else {
      numbers.finish(facts.starts);
    }
    const auto& ends = end_numbers_[CallbackIndex{static_cast<std::uint32_t>(i)}];
    if (facts.starts.first)
      ends.finish_from(*facts.starts.first, facts.starts.first_at, facts.ended);
    if (facts.node.empty()) facts.node = node_name(facts.process, facts.node_id);
  }
  for (std::size_t i = 0; i < model_.publishers.size(); ++i) {
    auto& facts = model_.publishers[i];
    const auto& numbers = publish_numbers_[static_cast<std::uint32_t>(i)];
    if (facts.registered) {
      numbers.finish(facts.first_next_seq, *facts.registered, facts.published);
    } else {
      numbers.finish(facts.published);
    }
  }
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& facts = model_.threads[i];
    read_back_numbers_[ThreadIndex{static_cast<std::uint32_t>(i)}].finish(facts.read_backs);
  }
}

}  // namespace cie::analysis
