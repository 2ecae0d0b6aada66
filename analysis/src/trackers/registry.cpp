#include "registry.hpp"

#include <cie/analysis/namespaced_pid.hpp>

#include "model/recorded_parts.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

// Of one time, in the kernel's stream and in its own, its exit may have come last: a tracer's clock may count
// microseconds alone.
bool was_gone_at(const ThreadFacts& thread, Timestamp time) {
  const bool is_of_exit = thread.kernel_exit && time <= thread.kernel_exit->time;
  return is_gone(thread) && (thread.is_tid_given_anew || !is_of_exit);
}

}  // namespace

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
  process.pid = plain_pid(pid);
  process.told_pid = pid;
  process.monotonic_offset_ns = recorded_offset_ns(model_, process);
  process_by_pid_[{scope(host), pid}] = index;
  return index;
}

std::optional<ProcessIndex> Registry::process_of(const EventHead& head) {
  if (!head.pid) return std::nullopt;
  const auto host = host_of(head);
  const auto* found = process_by_pid_.find({scope(host), *head.pid});
  const auto index = found != nullptr ? *found : new_process(host, *head.pid);
  auto& process = model_.processes[at(index)];
  if (!process.first_seen) {
    process.first_seen = ref(head);
    note_trace(head, process);
  }
  emitters_.process_seen(index, ref(head));
  return index;
}

void Registry::note_trace(const EventHead& head, ProcessFacts& process) const {
  if (at(head.stream) >= model_.streams.size()) return;
  const auto trace = model_.streams[at(head.stream)].trace;
  if (std::ranges::find(process.traces, trace) == process.traces.end())
    process.traces.push_back(trace);
}

std::optional<ProcessIndex> Registry::reported_process_of(const EventHead& head) {
  const auto process = process_of(head);
  if (process) note_reported(head, *process);
  return process;
}

ThreadIndex Registry::new_thread(ProcessIndex process, std::int64_t tid) {
  emitters_.forget(model_.processes[at(process)].told_pid, tid);
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

void Registry::set_known_to_kernel(ProcessIndex process) {
  const auto& facts = model_.processes[at(process)];
  const bool is_known = has_tids_of_kernel(facts);
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    if (thread.process != process || thread.is_known_to_kernel == is_known) continue;
    const auto index = ThreadIndex{static_cast<std::uint32_t>(i)};
    thread.is_known_to_kernel = is_known;
    auto& holder = thread_by_host_tid_[{scope(facts.host), thread.tid}];
    if (is_known && !is_gone(thread)) holder = index;
    if (is_known) continue;
    if (holder == index) holder.reset();
    forget_kernel_record(thread);
  }
}

void Registry::note_place(ProcessIndex process, bool is_where_switched) {
  auto& facts = model_.processes[at(process)];
  if (is_pid_ns_known(facts) || facts.speaks_where_switched == is_where_switched) return;
  facts.speaks_where_switched = is_where_switched;
  set_known_to_kernel(process);
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
  if (!index || was_gone_at(model_.threads[at(*index)], head.time))
    index = new_thread(*process, *head.tid);
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
    auto& of = model_.processes[at(process)];
    // Its own events would have told: this follows from ROS 2's.
    if (!of.has_cie_events) of.has_cie_events = of.is_from_ros2 = true;
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

std::optional<GroupType> Registry::group_type_of(const CallbackFacts& callback) const {
  if (!callback.group) return std::nullopt;
  const auto* group = group_by_id_.find({scope(callback.process), key(*callback.group)});
  return group != nullptr ? model_.groups[*group].type : std::nullopt;
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
