// Whose events are whose where a process has ended and another one may have its pid by now.
#include <cie/analysis/namespaced_pid.hpp>

#include "model/loss_times.hpp"
#include "registry.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis {
namespace {

// Before the process began that tells of its run: that it did in a tick of the kernel's clock, and no
// earlier than it says, for suspends move what it says back.
bool was_seen_before(const ProcessFacts& process, const RunBegin& event) {
  return process.first_seen &&
         process.first_seen->time + kTickOfStart < Timestamp{event.process_start_ns};
}

bool is_of_one_tick(std::int64_t start, std::int64_t other) {
  return Timestamp{std::max(start, other)} - Timestamp{std::min(start, other)} < kTickOfStart;
}

// Taken for another process's, it could violate a rule. What a process may emit long after its run, as
// the release of a callback that nobody runs any more, could not.
bool tells_whose_it_is(const EventBody& body) {
  return std::visit(
      Overloaded{[](const CallbackStart&) { return true; }, [](const CallbackEnd&) { return true; },
                 [](const CallbackInit&) { return true; }, [](const GroupInit&) { return true; },
                 [](const ThreadInit&) { return true; }, [](const ThreadSched&) { return true; },
                 [](const auto&) { return false; }},
      body);
}

}  // namespace

std::optional<ProcessIndex> Registry::ended_holder_of_pid(const EventHead& head) const {
  if (!head.pid) return std::nullopt;
  const auto* known = known_emitter_of(head);
  const auto* found =
      known != nullptr ? &known->process : process_by_pid_.find({scope(host_of(head)), *head.pid});
  if (found == nullptr) return std::nullopt;
  const auto& end = model_.processes[at(*found)].run_end;
  return end && end->at.time < head.time ? std::optional(*found) : std::nullopt;
}

bool Registry::has_used_number_of(ProcessIndex process, const EventBody& body) const {
  const auto is_seen = [](const auto& numbers, auto index, std::uint64_t number,
                          const SequenceFacts& facts) {
    const auto* tracker = numbers.find(index);
    return tracker != nullptr && tracker->is_seen(number, facts);
  };
  const auto* const start = std::get_if<CallbackStart>(&body);
  const auto* const end = std::get_if<CallbackEnd>(&body);
  if (start != nullptr || end != nullptr) {
    const auto* found = callback_by_id_.find(
        {scope(process), key(start != nullptr ? start->callback : end->callback)});
    if (found == nullptr) return false;
    const auto& facts = model_.callbacks[at(*found)];
    return start != nullptr ? is_seen(start_numbers_, *found, start->seq, facts.starts)
                            : is_seen(end_numbers_, *found, end->seq, facts.ended);
  }
  const auto* const publish = std::get_if<Publish>(&body);
  if (publish == nullptr) return false;
  const auto* found = publisher_by_id_.find({scope(process), key(publish->publisher)});
  return found != nullptr &&
         is_seen(publish_numbers_, *found, publish->seq, model_.publishers[*found].published);
}

void Registry::detect_reused_pid(const EventHead& head, const RunBegin& event,
                                 const LossTimes& losses) {
  const auto pid = head.pid.value_or(event.pid);
  const auto* const found = process_by_pid_.find({scope(host_of(head)), pid});
  if (found == nullptr) return;
  const auto former = *found;
  const bool is_pid_own = event.pid == plain_pid(pid);
  const auto is_of = [&](const ProcessFacts& process) {
    // Two that begin in one tick of the kernel's clock have the same start.
    return process.start_ns == event.process_start_ns && process.pid_ns == event.pid_ns &&
           process.is_pid_own == is_pid_own;
  };
  const auto& known = model_.processes[at(former)];
  if (!known.start_ns && !was_seen_before(known, event)) return;
  if (known.start_ns && is_of(known)) {
    // Another session tells of it at the same time.
    const bool is_told_again = known.last_begin_told == event.monotonic_ns;
    if (event.moment != RunMoment::start || is_told_again) return;
    if (known.run_end || losses.any_between(known.host, known.last_begin, head.time)) {
      note_begun_again(former, head, event);
      return;
    }
    // No process begins to run twice before it ends: it executes another program.
  }
  const auto index = new_process(host_of(head), pid);
  pass_name_on(former, index);
  auto& before = model_.processes[at(former)];
  auto& process = model_.processes[at(index)];
  process.first_seen = process.last_seen = ref(head);
  // Of one whose run_begin was not seen the namespace is unknown.
  const bool is_of_one_namespace =
      before.start_ns && before.is_pid_own && is_pid_own && before.pid_ns == event.pid_ns;
  // exec() keeps the pid, and the start, which is read anew. Nothing of the program before follows.
  const bool is_after_exec = is_of_one_namespace && event.moment == RunMoment::start &&
                             is_of_one_tick(*before.start_ns, event.process_start_ns);
  if (!before.run_end && !is_of_one_namespace) {
    before.shares_pid_since = process.shares_pid_since = ref(head);
  } else if (!before.run_end && !is_after_exec &&
             has_run_since(former, Timestamp{event.process_start_ns})) {
    before.shares_pid_since = process.shares_pid_since = ref(head);
    before.pid_sharing = process.pid_sharing = PidSharing::announced_late;
  }
}

// Starts of processes are told in ticks of the kernel's clock, and are those of a clock that is never
// behind the trace's.
bool Registry::has_run_since(ProcessIndex process, Timestamp start) const {
  return std::ranges::any_of(model_.callbacks, [&](const CallbackFacts& callback) {
    return callback.process == process && callback.is_accounted && callback.starts.last &&
           callback.starts.last_at.time > start + kTickOfStart;
  });
}

// The ids of a process go on from one run to the next, those of another program begin anew.
void Registry::note_begun_again(ProcessIndex index, const EventHead& head, const RunBegin& event) {
  emitters_.forget_all();
  auto& begun = begun_again_.insert_or_assign(index, BegunAgain{}).first->second;
  begun.head = head;
  begun.event = event;
  begun.keep_texts();
  begun.before = model_.processes[at(index)];
  begun.nodes = model_.nodes.size();
  begun.groups = model_.groups.size();
  begun.callbacks = model_.callbacks.size();
  begun.publishers = model_.publishers.size();
  begun.main = find_thread(index, begun.before.pid);
  if (!begun.main) return;
  const auto& main = model_.threads[at(*begun.main)];
  begun.main_last_seen = main.last_seen;
  begun.main_switched_in = main.switched_in;
}

bool Registry::is_given_before(ProcessIndex process, const BegunAgain& begun,
                               const EventBody& body) const {
  const auto since = begun.head.time;
  // A callback may be released, and a publisher publish, before the run begins that tells of them.
  const auto is_other = [since](const auto& registered, const auto* fini,
                                const SequenceFacts& numbers, std::uint64_t next) {
    return (registered && registered->time < since) || (fini != nullptr && fini->time < since) ||
           (numbers.last && numbers.last_at.time < since && next <= *numbers.last);
  };
  return std::visit(
      Overloaded{[&](const NodeInit& e) {
                   const auto* known = node_by_id_.find({scope(process), key(e.node)});
                   return known != nullptr && *known < begun.nodes;
                 },
                 [&](const GroupInit& e) {
                   const auto* known = group_by_id_.find({scope(process), key(e.group)});
                   return known != nullptr && *known < begun.groups;
                 },
                 [&](const CallbackInit& e) {
                   const auto* known = callback_by_id_.find({scope(process), key(e.callback)});
                   if (known == nullptr || at(*known) >= begun.callbacks) return false;
                   const auto& facts = model_.callbacks[at(*known)];
                   return is_other(facts.registered, facts.fini ? &facts.fini->at : nullptr,
                                   facts.starts, e.next_seq);
                 },
                 [&](const PublisherInit& e) {
                   const auto* known = publisher_by_id_.find({scope(process), key(e.publisher)});
                   if (known == nullptr || *known >= begun.publishers) return false;
                   const auto& facts = model_.publishers[*known];
                   return is_other(facts.registered, facts.fini ? &facts.fini->first : nullptr,
                                   facts.published, e.next_seq);
                 },
                 [](const auto&) { return false; }},
      body);
}

void Registry::detect_another_program(const EventHead& head, const EventBody& body) {
  if (begun_again_.empty() || head.is_derived || !head.pid) return;
  const auto* const found = process_by_pid_.find({scope(host_of(head)), *head.pid});
  if (found == nullptr) return;
  const auto former = *found;
  const auto begun = begun_again_.find(former);
  if (begun == begun_again_.end() || !is_given_before(former, begun->second, body)) return;
  begin_another_program(former, begun->second);
  begun_again_.erase(begun);
}

// As if its run_begin had told it.
void Registry::begin_another_program(ProcessIndex former, const BegunAgain& begun) {
  const auto since = begun.head.time;
  const auto index = new_process(begun.before.host, begun.before.told_pid);
  model_.processes[at(former)] = begun.before;
  pass_name_on(former, index);
  if (begun.main) {
    auto& main = model_.threads[at(*begun.main)];
    main.last_seen = begun.main_last_seen;
    main.switched_in = begun.main_switched_in;
  }
  for (std::size_t i = 0; i < model_.threads.size(); ++i) {
    auto& thread = model_.threads[i];
    const auto& first = thread.first_seen ? thread.first_seen : thread.announced;
    if (thread.process != former || !first || first->time < since) continue;
    thread.process = index;
    thread_by_process_tid_[{scope(index), thread.tid}] = ThreadIndex{static_cast<std::uint32_t>(i)};
  }
  apply(begun.head, begun.event);
}

void Registry::pass_name_on(ProcessIndex former, ProcessIndex index) {
  const auto found = names_before_.find(former);
  if (found == names_before_.end()) return;
  auto& facts = model_.processes[at(former)];
  // A session that attached named the one that it found.
  const bool is_own = found->second.empty() && facts.first_moment == RunMoment::announce;
  if (!is_own) model_.processes[at(index)].name = std::exchange(facts.name, found->second);
  names_before_.erase(found);
}

void Registry::detect_reused_pid_after_end(const EventHead& head, const EventBody& body,
                                           const LossTimes& losses) {
  const auto holder = ended_holder_of_pid(head);
  if (!holder) return;
  if (!head.is_derived && has_used_number_of(*holder, body)) {
    pass_name_on(*holder, new_process(host_of(head), *head.pid));
    return;
  }
  auto& process = model_.processes[at(*holder)];
  if (process.shares_pid_since || !tells_whose_it_is(body)) return;
  const auto known_until = std::max(process.run_end->at.time, process.last_begin);
  if (!losses.any_between(process.host, known_until, head.time)) return;
  process.shares_pid_since = ref(head);
  process.pid_sharing = PidSharing::perhaps;
}

// Threads of one reentrant callback may tell of its starts in another order than that of their numbers.
bool Registry::is_of_another(std::uint64_t seq, CallbackIndex callback,
                             const SequenceTracker& numbers, const SequenceFacts& seen) const {
  if (!seen.last || seen.is_restarted || seq > *seen.last) return false;
  return numbers.is_seen(seq, seen) ||
         group_type_of(model_.callbacks[at(callback)]) == GroupType::mutually_exclusive;
}

void Registry::note_other_start(std::uint64_t seq, const EventRef& where, CallbackIndex callback,
                                SequenceFacts& starts) {
  auto& numbers = start_numbers_[callback];
  if (is_of_another(seq, callback, numbers, starts))
    note_told_again(model_.callbacks[at(callback)].process, where);
  numbers.observe(seq, where, starts);
}

void Registry::note_told_again(ProcessIndex process, const EventRef& where) {
  auto& told_again = model_.processes[at(process)].told_again;
  if (!told_again) told_again = where;
}

void Registry::note_made_again(const EventHead& head, ProcessIndex process) {
  const bool may_repeat = model_.processes[at(process)].announcements != 0;
  if (!head.is_derived && !may_repeat) note_told_again(process, ref(head));
}

void Registry::doubt_told_again(const LossTimes& losses) {
  for (auto& process : model_.processes) {
    if (!process.told_again || process.shares_pid_since) continue;
    const auto since = process.first_seen.value_or(*process.told_again).time;
    const bool may_be_another =
        !process.run_begin || losses.any_between(process.host, since, process.told_again->time);
    if (!may_be_another) continue;
    process.shares_pid_since = *process.told_again;
    process.pid_sharing = PidSharing::told_again;
  }
}

}  // namespace cie::analysis
