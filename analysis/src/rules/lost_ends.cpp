#include "lost_ends.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"

#include <algorithm>
#include <limits>
#include <string>

namespace cie::analysis {

LostEnds::LostEnds(const Model& model, const ThreadLives& lives, const KernelHoles& holes,
                   const UserLossesOfProcesses& user_losses)
    : model_(model),
      lives_(lives),
      holes_(holes),
      user_losses_(user_losses),
      announced_(model.processes.size()) {
  for (const auto& thread : model.threads) {
    if (thread.announced) announced_[at(thread.process)] += thread.spins;  // as run_end counts
  }
  last_activities_.reserve(model.callbacks.size());
  for (const auto& callback : model.callbacks) {
    auto& last = last_activities_.emplace_back(Timestamp{std::numeric_limits<std::int64_t>::min()});
    for (const auto* pair : callback.ran_on)
      last = std::max(last, pair->last_activity.time);
  }
}

std::optional<Evidence> LostEnds::of(ThreadIndex index) const {
  const auto& thread = model_.threads[at(index)];
  const auto& run_end = model_.processes[at(thread.process)].run_end;
  if (thread.fini || !run_end) return std::nullopt;
  if (!thread.announced) {
    if (announced_[at(thread.process)] >= run_end->threads) return std::nullopt;
    return evidence("run_end", run_end->at,
                    "thread " + std::to_string(thread.tid) +
                        " was not seen to be announced: it may have ended and begun anew");
  }
  // A callback that went on elsewhere may have left a thread that was replaced.
  const bool has_stayed = std::ranges::any_of(thread.ran, [this](const CallbackOnThread* pair) {
    return last_activities_[at(pair->callback)] <= pair->last_activity.time;
  });
  if (!has_stayed) return std::nullopt;
  return evidence("run_end", run_end->at,
                  "the end of thread " + std::to_string(thread.tid) +
                      " was not seen: callbacks may have started after it");
}

std::optional<Evidence> LostEnds::between(ThreadIndex index, Timestamp last, Timestamp next) const {
  const auto& thread = model_.threads[at(index)];
  const auto named = "thread " + std::to_string(thread.tid);
  if (!thread.fini && lives_.is_tid_given_anew(index, last, next)) {
    return without_event(moment(next, thread.tid),
                         "another " + named + " was created before: this may have run on it");
  }
  const auto& run_end = model_.processes[at(thread.process)].run_end;
  if (!run_end) return user_losses_.between(thread.process, last, next);
  if (thread.fini && announced_[at(thread.process)] >= run_end->threads) return std::nullopt;
  return evidence("run_end", run_end->at,
                  (thread.fini ? "announcements of threads are missing"
                               : "the end of " + named + " was not seen") +
                      std::string(": another one may have had its tid"));
}

std::optional<Evidence> LostEnds::untold_between(ThreadIndex index, Timestamp last,
                                                 Timestamp next) const {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  if (thread.tid == process.pid || !is_ros2_only(process)) {
    return between(index, last, next);
  }
  // Its exit would be in the kernel's record.
  const bool is_exit_told =
      model_.hosts[at(process.host)].has_switches && !holes_.since(process.host, last, next);
  if (is_exit_told) return std::nullopt;
  return without_event(moment(next, thread.tid),
                       "no event of ROS 2 tells that a thread ends: another one may have had the "
                       "tid " +
                           std::to_string(thread.tid) + " before");
}

std::optional<Evidence> LostEnds::between_callbacks(ThreadIndex index) const {
  std::optional<Evidence> why;
  std::optional<Timestamp> last;
  for (const auto* pair : model_.threads[at(index)].ran) {
    if (!pair->is_certain || !is_of_its_own(model_.callbacks[at(pair->callback)])) continue;
    const auto next = pair->first_start.time;
    if (last) {
      why = next > *last ? untold_between(index, *last, next) : std::nullopt;
      if (!why) return std::nullopt;
    }
    last = std::max(last.value_or(pair->last_activity.time), pair->last_activity.time);
  }
  return why;
}

std::optional<Evidence> LostEnds::since(ThreadIndex index, Timestamp last) const {
  const auto& thread = model_.threads[at(index)];
  const auto& process = model_.processes[at(thread.process)];
  if (thread.tid == process.pid || !is_ros2_only(process)) return std::nullopt;
  std::optional<Timestamp> next;
  for (const auto* pair : thread.ran) {
    const auto first = pair->first_start.time;
    if (first > last) next = std::min(next.value_or(first), first);
    if (first <= last && pair->last_activity.time > last) return std::nullopt;
  }
  return next ? untold_between(index, last, *next) : std::nullopt;
}

}  // namespace cie::analysis
