// What applications and the kernel announce: processes, nodes, callbacks, publishers, threads.
#include <cie/analysis/deadline.hpp>

#include "model/callback_questions.hpp"
#include "model/parameters_in_force.hpp"
#include "registry.hpp"

#include <algorithm>
#include <string_view>

namespace cie::analysis {

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

void Registry::apply(const EventHead& head, const RunBegin& event) {
  auto of_process = head;
  if (!of_process.pid) of_process.pid = event.pid;
  const auto index = *process_of(of_process);
  auto& process = model_.processes[at(index)];
  note_reported(head, index);
  process.executor = event.executor;
  note_trace(head, process);
  if (event.moment == RunMoment::announce) {
    ++process.announcements;
    process.announcing_tid = head.tid;
    process.is_announcing_callbacks = true;
  }
  if (event.moment == RunMoment::start) process.run_end.reset();  // it runs again, to another end
  process.last_begin = head.time;
  process.last_begin_told = event.monotonic_ns;
  // It has the pid as before: what came meanwhile was its own.
  if (process.start_ns == event.process_start_ns && process.pid_sharing == PidSharing::perhaps) {
    process.shares_pid_since.reset();
    process.pid_sharing = {};
  }
  if (process.specs.empty() || event.spec_sha256 != process.specs.back().sha256) {
    process.specs.push_back({.since = head.time, .sha256 = std::string(event.spec_sha256)});
  }
  if (process.run_begin) return;
  process.run_begin = ref(head);
  process.first_moment = event.moment;
  process.boot_id = event.boot_id;
  process.tool_version = event.tool_version;
  process.start_ns = event.process_start_ns;
  const bool had_tids_of_kernel = has_tids_of_kernel(process);
  process.pid_ns = event.pid_ns;
  if (event.monotonic_offset_ns != 0) process.monotonic_offset_ns = event.monotonic_offset_ns;
  if (has_tids_of_kernel(process) != had_tids_of_kernel) set_known_to_kernel(index);
  process.is_pid_own = event.pid == process.pid;
  process.contract_version = event.contract_version;
  process.online_cpus = event.online_cpus;
}

void Registry::apply(const EventHead& head, const RunEnd& event) {
  const auto index = reported_process_of(head);
  if (!index) return;
  is_any_ended_ = true;
  auto& process = model_.processes[at(*index)];
  process.run_end = RunTotals{.at = ref(head),
                              .callbacks = event.callbacks,
                              .threads = event.threads,
                              .groups = event.groups,
                              .publishers = event.publishers,
                              .status = event.status};
}

void Registry::apply(const EventHead& head, const NodeInit& event) {
  const auto process = reported_process_of(head);
  if (!process) return;
  const auto [index, is_new] = node_by_id_.insert({scope(*process), key(event.node)});
  if (is_new) {
    *index = static_cast<std::uint32_t>(model_.nodes.size());
    model_.nodes.push_back(
        NodeFacts{.process = *process, .id = event.node, .name = std::string(event.name)});
    return;
  }
  note_made_again(head, *process);
}

void Registry::apply(const EventHead& head, const GroupInit& event) {
  const auto process = reported_process_of(head);
  if (!process) return;
  auto& facts = model_.groups[group(*process, event.group, head)];
  if (facts.type) note_made_again(head, *process);
  facts.node = event.node;
  facts.type = event.type;
  facts.is_accounted = !head.is_derived;
}

bool Registry::is_of_another(const CallbackInit& event, const CallbackFacts& facts,
                             bool is_announcement) const {
  if (!facts.is_accounted || !event.inferred.is_identified) return false;
  if (facts.fini) return true;
  // One that starts while its state is repeated need not count there.
  const auto& process = model_.processes[at(facts.process)];
  const bool is_counted = !is_announcement || facts.starts.last_at.time < process.last_begin;
  if (facts.starts.last && is_counted && event.next_seq <= *facts.starts.last) return true;
  const std::string_view told_id = has_logical_id(facts) ? facts.logical_id : std::string_view();
  return event.logical_id != told_id || event.kind != facts.kind || event.source != facts.source ||
         event.period_ns != facts.period_ns || event.queue_depth != facts.queue_depth ||
         event.deadline_ns != facts.deadline_ns;
}

namespace {

bool is_by_announcer(const EventHead& head, const ProcessFacts& process) {
  return !process.announcing_tid || !head.tid || *head.tid == *process.announcing_tid;
}

// An announcement tells callbacks before publishers and threads, all by one thread.
bool may_announce(const EventHead& head, const ProcessFacts& process) {
  return process.is_announcing_callbacks && is_by_announcer(head, process);
}

// What an announcement tells behind its callbacks.
void note_behind_callbacks(const EventHead& head, ProcessFacts& process) {
  const bool is_told = process.announcing_tid && head.tid == process.announcing_tid;
  if (is_told) process.is_announcing_callbacks = false;
}

}  // namespace

void Registry::apply(const EventHead& head, const CallbackInit& event) {
  const auto process = reported_process_of(head);
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
  if (is_announcement && facts.last_told) facts.announced_after = {*facts.last_told, ref(head)};
  facts.last_told = head.time;
  if (facts.registered) {
    // Ids are given once: another process has this pid, and its run_begin was not seen.
    auto& of = model_.processes[at(*process)];
    if (!of.shares_pid_since && is_of_another(event, facts, is_announcement)) {
      of.shares_pid_since = ref(head);
      of.pid_sharing = PidSharing::other_init;
    }
    return;
  }
  facts.registered = ref(head);
  facts.may_repeat = may_announce(head, model_.processes[at(*process)]);
  facts.first_next_seq = event.next_seq;
  facts.is_accounted = !head.is_derived;
  facts.is_identified = event.inferred.is_identified && !event.logical_id.empty();
  facts.is_after_rcl_init = event.inferred.is_after_rcl_init;
  facts.made = event.inferred.made.value_or(head.time);
  if (!event.logical_id.empty()) facts.logical_id = event.logical_id;
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
  facts.first_expiry = event.inferred.first_expiry;
  facts.grid.spread = event.inferred.expiry_spread;
  if (to_number(event.group) != kNoId) {
    facts.group = event.group;
    model_.groups[group(*process, event.group, head)].callbacks.push_back(index);
  }
  if (event.inferred.shares_address) note_shared_address(head, index);
  if (event.inferred.former != kNoCallback)
    note_shared_address(head, callback(*process, event.inferred.former));
}

void Registry::apply(const EventHead& head, const CallbackFini& event) {
  const auto process = process_of(head);
  if (!process) return;
  auto& fini = model_.callbacks[at(callback(*process, event.callback))].fini;
  if (fini) note_told_again(*process, ref(head));
  fini = CallbackTotals{.at = ref(head),
                        .started = event.started,
                        .ended = event.ended,
                        .released = event.released,
                        .overwritten = event.overwritten,
                        .lost = event.lost};
}

void Registry::apply(const EventHead& head, const PublisherInit& event) {
  const auto process = reported_process_of(head);
  if (!process) return;
  note_behind_callbacks(head, model_.processes[at(*process)]);
  const auto index = publisher(*process, event.publisher);
  auto& facts = model_.publishers[index];
  if (facts.registered) {
    note_made_again(head, *process);
    return;
  }
  if (facts.awaited_since) {
    facts.awaited_since = {};
    --awaited_publishers_;
  }
  facts.registered = ref(head);
  facts.first_next_seq = event.next_seq;
  facts.topic = event.topic;
  facts.writer_gid = event.writer_gid;
  facts.node = event.node;
  facts.is_accounted = !head.is_derived;
  ++publishers_told_;
  last_publisher_told_ = head.time;
  publisher_by_gid_[event.writer_gid] = index;
  const auto host = model_.processes[at(*process)].host;
  publisher_by_host_gid_[{scope(host), static_cast<std::int64_t>(event.writer_gid)}] = index;
}

void Registry::apply(const EventHead& head, const PublisherFini& event) {
  const auto process = process_of(head);
  if (!process) return;
  model_.publishers[publisher(*process, event.publisher)].fini = {ref(head), event.published};
}

namespace {

// It was announced for another callback, or for another group without a callback.
bool is_of_another_owner(const ThreadFacts& thread, const ThreadInit& event) {
  const bool has_callback = event.callback != kNoCallback;
  if (thread.callback) return has_callback && event.callback != *thread.callback;
  return thread.group && event.group != kNoGroup && event.group != *thread.group;
}

// Requires that it was announced.
void keep_former(ThreadFacts& thread, const EventRef& next) {
  if (thread.former.size() < kMostFormer) {
    const auto since = thread.former.empty() ? *thread.announced : thread.former.back().next;
    thread.former.push_back({.at = since,
                             .next = next,
                             .fini = thread.fini,
                             .callback = thread.callback,
                             .group = thread.group,
                             .last_change = thread.last_change});
  }
  thread.callback.reset();
  thread.group.reset();
}

}  // namespace

std::optional<ThreadIndex> Registry::apply(const EventHead& head, const ThreadInit& event) {
  const auto process = reported_process_of(head);
  if (!process) return std::nullopt;
  note_behind_callbacks(head, model_.processes[at(*process)]);
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
  if (!thread.announced || thread.fini) ++thread.spins;
  if (thread.announced && is_of_another_owner(thread, event)) keep_former(thread, ref(head));
  if (thread.fini) {  // announced anew after its end: another spin on the same thread
    thread.fini.reset();
    thread.announced_again = head.time;
    thread.last_change = 0;
    SequenceTracker::restart(thread.read_backs);
  }
  if (!thread.announced) {
    thread.announced = ref(head);
    thread.announcements_at_init = model_.processes[at(*process)].announcements;
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

std::optional<ThreadIndex> Registry::apply(const EventHead& head, const ThreadFini& event) {
  const auto process = process_of(head);
  if (!process) return std::nullopt;
  const auto index = find_thread(*process, event.tid);
  if (!index) return std::nullopt;
  auto& thread = model_.threads[at(*index)];
  thread.fini = ref(head);
  thread.fini_read_backs += event.read_backs;
  return index;
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
  // Its object outlived it: whoever has its tid now was read.
  const bool is_of_other = event.moment == SchedMoment::audit && thread.kernel_exit &&
                           thread.kernel_exit->time < head.time;
  if (is_of_other) return std::nullopt;
  const bool is_last = !thread.last_read_back || !is_older(read_back, *thread.last_read_back);
  if (is_last) note_in_force(model_, thread, read_back);
  // What another spin on it begins with, the one before has left.
  if (event.moment == SchedMoment::initial && !thread.initial && !thread.announced_again &&
      (!thread.last_read_back || thread.last_read_back->at.time >= head.time)) {
    thread.initial = read_back;
  }
  if (event.moment == SchedMoment::applied) {
    note_applied(thread, read_back);
  }
  if (event.moment == SchedMoment::audit) {
    thread.audits = thread.audits.value_or(0) + 1;
    if (!thread.first_audit) thread.first_audit = read_back;
  }
  thread.last_change = std::max(thread.last_change, event.change);
  if (is_last) thread.last_read_back = std::move(read_back);
  return index;
}

void Registry::apply(const EventHead& head, const SchedProcessExit& event) {
  if (const auto index = thread_by_tid(host_of(head), event.tid))
    note_exit(head, *index, SchedProcessExit::kName);
}

void Registry::apply(const EventHead& head, const SchedProcessExec& event) {
  const auto index = thread_by_tid(host_of(head), event.old_tid);
  if (!index || is_gone(model_.threads[at(*index)])) return;
  auto& process = model_.processes[at(model_.threads[at(*index)].process)];
  if (process.pid == event.tid) process.executed = ref(head);
}

void Registry::apply(const EventHead& head, const ProcessName& event) {
  const auto process = process_of(head);
  if (!process) return;
  auto& facts = model_.processes[at(*process)];
  auto& name = facts.name;
  if (!head.is_derived && facts.run_begin) {
    auto& before = names_before_[*process];
    if (before.empty()) before = name;
  }
  if (!head.is_derived || name.empty()) name = event.name;
  if (!head.is_derived) return;
  // What follows from an event's context is what its thread is called.
  const auto thread = emitter_of(head).thread;
  if (thread && model_.threads[at(*thread)].name.empty()) {
    model_.threads[at(*thread)].name = event.name;
  }
}

}  // namespace cie::analysis
