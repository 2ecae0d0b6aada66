// Whose events are whose where a process has ended and another one may have its pid by now.
#include "model/loss_times.hpp"
#include "registry.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

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

void Registry::detect_reused_pid_after_end(const EventHead& head, const EventBody& body,
                                           const LossTimes& losses) {
  const auto holder = ended_holder_of_pid(head);
  if (!holder) return;
  if (!head.is_derived && has_used_number_of(*holder, body)) {
    new_process(host_of(head), *head.pid);
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
