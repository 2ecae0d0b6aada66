#include "thread_lives.hpp"

#include "thread_questions.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

// Another thread tells of one's end when that may be long gone. Null: none, or another's.
const std::optional<EventRef>* own_fini(const ThreadFacts& thread) {
  return is_fini_own(thread) ? &thread.fini : nullptr;
}

// What the kernel tells of a tid behind a hole of its record may be of another thread.
bool is_exit_its_own(const ThreadFacts& thread, HostIndex host, const KernelHoles& holes) {
  if (!thread.kernel_exit) return false;
  auto last = thread.announced ? thread.announced->time : Timestamp{thread.start_ns.value_or(0)};
  for (const auto* sign : {&thread.first_seen, &thread.last_seen, own_fini(thread)})
    if (sign != nullptr && *sign) last = std::max(last, (*sign)->time);
  for (const auto* pair : thread.ran)
    last = std::max(last, pair->last_activity.time);
  return !holes.since(host, last, thread.kernel_exit->time);
}

ThreadLife life_of(const ThreadFacts& thread, HostIndex host, const KernelHoles& holes) {
  std::optional<Timestamp> begin;
  std::optional<Timestamp> end;
  const auto extend = [&begin, &end](Timestamp time) {
    begin = begin ? std::min(*begin, time) : time;
    end = end ? std::max(*end, time) : time;
  };
  if (thread.start_ns) extend({*thread.start_ns});
  for (const auto* sign :
       {&thread.announced, &thread.first_seen, &thread.last_seen, own_fini(thread)}) {
    if (sign != nullptr && *sign) extend((*sign)->time);
  }
  const bool has_exited = is_exit_its_own(thread, host, holes);
  if (has_exited) extend(thread.kernel_exit->time);
  std::optional<Timestamp> last_activity;
  for (const auto* pair : thread.ran) {
    const auto last = pair->last_activity.time;
    extend(pair->first_start.time);
    extend(last);
    last_activity = last_activity ? std::max(*last_activity, last) : last;
  }
  const auto last = end.value_or(Timestamp{});
  std::optional<Timestamp> ended_by;
  if (thread.fini) ended_by = std::max(last, thread.fini->time);
  if (has_exited || own_fini(thread) != nullptr) ended_by = last;
  return {.begin = begin.value_or(Timestamp{}),
          .end = last,
          .last_activity = last_activity,
          .ended_by = ended_by,
          .has_exited = has_exited};
}

}  // namespace

ThreadLives::ThreadLives(const Model& model, const KernelHoles& holes)
    : model_(model), holes_(holes) {
  lives_.reserve(model.threads.size());
  births_.reserve(model.threads.size());
  for (const auto& thread : model.threads) {
    const auto index = ThreadIndex{static_cast<std::uint32_t>(lives_.size())};
    const auto host = model.processes[at(thread.process)].host;
    births_.push_back(birth(index, lives_.emplace_back(life_of(thread, host, holes)).begin));
    if (thread.tid != model.processes[at(thread.process)].pid) continue;
    if (is_exit_its_own(thread, host, holes)) {
      exited_.insert(thread.process);
    } else {
      exited_.erase(thread.process);  // the pid was given anew
    }
  }
  std::ranges::sort(births_);
  for (const auto& process : model.processes)
    last_signs_.push_back(process.last_seen.value_or(EventRef{}).time);
  for (const auto& thread : model.threads) {
    auto& last = last_signs_[at(thread.process)];
    if (thread.switched_in) last = std::max(last, thread.switched_in->time);
  }
}

ThreadLives::Birth ThreadLives::birth(ThreadIndex index, Timestamp time) const {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  return {process.host, process.pid_ns, thread.tid, time};
}

std::optional<Evidence> ThreadLives::may_be_another(ThreadIndex index, Timestamp time) const {
  const auto last = of(index).end;
  if (time <= last) return std::nullopt;
  return holes_.since(model_.processes[at(model_.threads[at(index)].process)].host, last, time);
}

bool ThreadLives::is_tid_given_anew(ThreadIndex thread, Timestamp begin, Timestamp end) const {
  const auto next = std::ranges::upper_bound(births_, birth(thread, begin));
  return next != births_.end() && *next <= birth(thread, end);
}

bool ThreadLives::is_cut_by_end(const OpenInstance& open) const {
  if (at(open.thread) >= lives_.size()) return false;
  const auto& last = of(open.thread).last_activity;
  return !last || *last <= open.start.time;
}

bool ThreadLives::is_end_lost(const CallbackFacts& callback, const OpenInstance& open) const {
  return callback.ended.last && open.seq < *callback.ended.last && !open.is_left &&
         !is_cut_by_end(open);
}

}  // namespace cie::analysis
