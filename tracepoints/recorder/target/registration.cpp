#include "target/registration.hpp"

#include <cie/tracepoints/policy.hpp>
#include <cie/tracepoints/sched_attr.hpp>

#include "system/error.hpp"
#include "system/processes.hpp"

#include <cstdint>
#include <string>

#include <fmt/format.h>
#include <sys/types.h>

namespace cie::record {
namespace {

constexpr std::chrono::milliseconds kLookInterval{200};
constexpr std::chrono::milliseconds kUsualAnswer{100};  // what LTTng takes seldom longer for

// The kernel lets such a thread make no other one (sched(7)), so that LTTng-UST, which makes two and waits for them
// before main(), never returns.
bool may_make_no_threads(pid_t pid) {
  SchedAttr attributes;
  return get_sched_attr(static_cast<std::uint32_t>(pid), attributes) == 0 &&
         attributes.policy == static_cast<std::uint32_t>(Policy::deadline) &&
         (attributes.flags & kSchedFlagResetOnFork) == 0;
}

std::string nobody_registered(const Target& target, bool is_ros2) {
  if (!target.is_command()) {
    return "no traced application has registered yet: waiting for one. One that runs already "
           "may take some 5 s to find a session daemon that was just started";
  }
  if (may_make_no_threads(target.pid())) {
    return "no application has registered yet: the command runs under SCHED_DEADLINE, where the "
           "kernel refuses it the threads that LTTng needs. Let its threads have the default "
           "policy (SCHED_FLAG_RESET_ON_FORK: chrt -R -d ...)";
  }
  if (is_ros2) {
    return "no application of ROS 2 has registered yet: does the command start nodes, and were "
           "their tracetools built with LTTng (ros2 run tracetools status)?";
  }
  return "no traced application has registered yet: does the command use cie::executor, and "
         "was it built with CIE_WITH_LTTNG? (applications of ROS 2: --ros2)";
}

}  // namespace

void Registration::look(const std::shared_ptr<TracingSession>& session, const Target& target,
                        bool is_any_told) {
  if (!asking_) {
    const auto now = std::chrono::steady_clock::now();
    if (is_anybody() || now < next_look_) return;
    next_look_ = now + kLookInterval;
    asking_.emplace([session] { return session->traced_processes(); });
  }
  if (!asking_->is_done(kUsualAnswer)) return;
  try {
    first_ = answer_of(asking_);
  } catch (const RecordError&) {
    return;  // the daemon's own state is watched elsewhere
  }
  const bool is_nobody = !is_anybody() && !is_any_told;
  if (is_nobody && !has_warned_of_nobody_ && target.age() > patience_) {
    has_warned_of_nobody_ = true;
    console_.warn(nobody_registered(target, is_ros2_));
  }
}

bool Registration::settle(std::chrono::seconds patience) const {
  return !asking_ || asking_->is_done(patience);
}

void Registration::warn_of_others(const Target& target) {
  for (const TracedProcess& process : first_) {
    if (!has_warned_of_others_ && !descends_from(process.pid, target.pid()) &&
        parent_of(process.pid) != 0) {
      has_warned_of_others_ = true;
      console_.warn(fmt::format(
          "this session daemon serves other traced processes too, e.g. {} (pid {}): they are "
          "recorded as well",
          process.name, process.pid));
    }
  }
}

}  // namespace cie::record
