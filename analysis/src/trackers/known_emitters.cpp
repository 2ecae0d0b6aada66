#include "known_emitters.hpp"

namespace cie::analysis {

KnownEmitter& KnownEmitters::keep(const EventHead& head, HostIndex host, ProcessIndex process,
                                  ThreadIndex thread) {
  if (places_.size() < 2 * model_.threads.size() && places_.size() < kMost) {
    forget_all();
    places_.resize(2 * places_.size());
    last_place_ = places_.size() - 1;
  }
  auto& known = places_[place(head.pid, head.tid)];
  forget(known);
  known = KnownEmitter{.thread_facts = &model_.threads[at(thread)],
                       .process_facts = &model_.processes[at(process)],
                       .host = host,
                       .process = process,
                       .thread = thread,
                       .pid = head.pid,
                       .tid = head.tid,
                       .last_cpu = head.cpu,
                       .last_time = head.time,
                       .last_turn = turn_,
                       .ran = {},
                       .ran_facts = nullptr,
                       .released = {},
                       .published = {}};
  return known;
}

void KnownEmitters::forget_all() {
  for (auto& known : places_)
    forget(known);
}

void KnownEmitters::forget(KnownEmitter& known) {
  if (known.thread_facts == nullptr) return;
  known.thread_facts->last_seen = known.last_seen();
  note_last_seen(known.process, known.last_seen(), known.last_turn);
  known.thread_facts = nullptr;
}

void KnownEmitters::note_last_seen(ProcessIndex process, const EventRef& event,
                                   std::uint64_t turn) {
  auto& last = process_turns_[process];
  if (turn < last) return;
  last = turn;
  model_.processes[at(process)].last_seen = event;
}

}  // namespace cie::analysis
