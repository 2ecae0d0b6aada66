#include "target/registration.hpp"

#include "system/error.hpp"
#include "system/processes.hpp"

#include <fmt/format.h>

namespace cie::record {
namespace {

constexpr std::chrono::milliseconds kLookInterval{200};

}  // namespace

void Registration::look(const TracingSession& session, const Target& target) {
  const auto now = std::chrono::steady_clock::now();
  if (is_anybody() || now < next_look_) {
    return;
  }
  next_look_ = now + kLookInterval;
  try {
    first_ = session.traced_processes();
  } catch (const RecordError&) {
    return;  // the daemon's own state is watched elsewhere
  }
  if (!is_anybody() && !has_warned_of_nobody_ && target.age() > patience_) {
    has_warned_of_nobody_ = true;
    console_.warn(
        !target.is_command()
            ? "no traced application has registered yet: waiting for one. One that runs already "
              "may take some 5 s to find a session daemon that was just started"
        : is_ros2_
            ? "no application of ROS 2 has registered yet: does the command start nodes, and were "
              "their tracetools built with LTTng (ros2 run tracetools status)?"
            : "no traced application has registered yet: does the command use cie::executor, and "
              "was it built with CIE_WITH_LTTNG? (applications of ROS 2: --ros2)");
  }
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
