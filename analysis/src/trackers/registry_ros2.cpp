// What ROS 2 tells of its processes besides.
#include "registry.hpp"

#include <string>
#include <utility>

namespace cie::analysis {

void Registry::apply(const EventHead& head, const Ros2ProcessBegin& /*event*/) {
  const auto process = process_of(head);
  if (!process) return;
  auto& begin = model_.processes[at(*process)].ros2_begin;
  if (!begin) begin = ref(head);
}

// Most events of ROS 2 mean nothing by themselves, and are not seen here.
void Registry::apply(const EventHead& head, const ProcessContinued& event) {
  const auto process = process_of(head);
  if (!process) return;
  auto& first = *model_.processes[at(*process)].first_seen;
  if (event.since >= first.time) return;
  first.time = event.since;
  first.stream = event.stream;
}

void Registry::apply(const EventHead& head, const InterleavedInstances& /*event*/) {
  note_sharing(head, PidSharing::crossed);
}

void Registry::apply(const EventHead& head, const ForeignInstance& /*event*/) {
  note_sharing(head, PidSharing::beside_own);
}

void Registry::apply(const EventHead& head, const ForeignCallback& event) {
  const auto process = process_of(head);
  if (!process) return;
  std::string id(event.logical_id);
  auto& first = model_.processes[at(*process)].beside_own[id];
  if (!event.ran) return;
  auto where = ref(head);
  where.time = *event.ran;
  where.stream = event.stream;
  if (!first) first = where;
  const auto thread = head.tid ? find_thread(*process, *head.tid) : std::nullopt;
  if (!thread) return;
  auto& of_thread = model_.threads[at(*thread)].beside_own;
  if (!of_thread) of_thread = {std::move(id), where};
}

void Registry::note_sharing(const EventHead& head, PidSharing sharing) {
  const auto index = process_of(head);
  if (!index) return;
  auto& process = model_.processes[at(*index)];
  if (process.shares_pid_since && process.pid_sharing != PidSharing::perhaps) return;
  process.shares_pid_since = ref(head);
  process.pid_sharing = sharing;
}

void Registry::note_shared_address(const EventHead& head, CallbackIndex index) {
  auto& facts = model_.callbacks[at(index)];
  if (!facts.own) facts.keep_own_apart(ref(head));
}

void Registry::apply(const EventHead& head, const Ros2Tracer& event) {
  if (const auto process = process_of(head))
    model_.processes[at(*process)].tracetools = event.version;
}

void Registry::apply(const EventHead& head, const UntracedEntity& event) {
  const auto process = process_of(head);
  if (!process) return;
  auto& hidden = model_.processes[at(*process)].hidden;
  if (event.hidden >= hidden.size()) hidden.resize(event.hidden + 1);
  auto& facts = hidden[event.hidden];
  if (facts.what.empty()) {
    facts.made = ref(head);
    facts.what = event.what;
    facts.is_client = event.is_client;
    facts.is_action = event.is_action;
  }
  if (!event.node.empty()) facts.node = event.node;  // which may be told last
  if (event.group != kNoGroup) facts.group = event.group;
  if (event.is_pooled) facts.is_pooled = true;
}

void Registry::apply(const EventHead& head, const UntracedWriter& event) {
  model_.unseen_writers.try_emplace(std::string(event.topic), ref(head));
}

void Registry::apply(const Emitter& who, const UntracedInstance& event) {
  if (!who.process) return;
  auto& process = model_.processes[at(*who.process)];
  process.tells_responses = true;
  if (who.thread && event.hidden < process.hidden.size()) {
    process.hidden[event.hidden].ran_on.insert(*who.thread);
  }
}

}  // namespace cie::analysis
