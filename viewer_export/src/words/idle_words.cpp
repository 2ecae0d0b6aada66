#include "idle_words.hpp"

#include "text_layout.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

namespace cie::viewer_export {

using analysis::Duration;
using analysis::Preemptor;

namespace {

// A budget that is not renewed by blocking ran out for certain where more than it was executed.
std::string by_deadline(const analysis::ThreadSchedReport& sched,
                        std::optional<Duration> executed) {
  constexpr std::uint64_t kReclaim = 0x02;  // SCHED_FLAG_RECLAIM of uapi/linux/sched.h
  const auto runtime = analysis::signed_ns(sched.runtime_ns);
  const bool is_used_up =
      executed && runtime > 0 && executed->ns > runtime && (sched.flags & kReclaim) == 0;
  if (!is_used_up) return "perhaps throttled by SCHED_DEADLINE";
  return fmt::format("throttled: its SCHED_DEADLINE runtime of {} was used up",
                     format_duration(runtime));
}

}  // namespace

std::string why_cpu_was_idle(const analysis::ThreadReport* thread,
                             std::optional<Duration> executed) {
  if (thread == nullptr || !thread->sched || !thread->former.empty())
    return "throttled, or the CPU had not switched yet";
  const auto& policy = thread->sched->policy_name;
  if (policy == "SCHED_DEADLINE") return by_deadline(*thread->sched, executed);
  if (policy == "SCHED_FIFO" || policy == "SCHED_RR")
    return "perhaps throttled by sched_rt_runtime_us";
  return "perhaps throttled by cpu.max of a cgroup";
}

std::string why_cpu_was_idle(const analysis::ReportRows& rows,
                             const analysis::CallbackReport& callback) {
  std::optional<Duration> executed;
  const bool has_blocked = !callback.blocked || callback.blocked->max > 0;
  if (callback.execution_time && !has_blocked) executed = Duration{callback.execution_time->max};
  return why_cpu_was_idle(only_thread_of(rows, callback), executed);
}

const analysis::ThreadReport* only_thread_of(const analysis::ReportRows& rows,
                                             const analysis::CallbackReport& callback) {
  return callback.threads.size() == 1 ? rows.find(callback.threads.front().thread) : nullptr;
}

Duration idle_time(const std::vector<Preemptor>& preempted_by) {
  const auto idle = std::ranges::find_if(preempted_by, &Preemptor::is_idle);
  return idle == preempted_by.end() ? Duration{} : idle->time;
}

const Preemptor* first_preemptor(const std::vector<Preemptor>& preempted_by) {
  const auto first = std::ranges::find_if_not(preempted_by, &Preemptor::is_idle);
  return first == preempted_by.end() ? nullptr : &*first;
}

}  // namespace cie::viewer_export
