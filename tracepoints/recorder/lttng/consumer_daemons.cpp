#include "lttng/consumer_daemons.hpp"

#include <algorithm>

namespace cie::record {

ConsumerDaemons::ConsumerDaemons(pid_t session_daemon) {
  if (session_daemon <= 0) return;
  for (const pid_t pid : children_of(session_daemon)) {
    // The one that records the kernel has that name, too.
    const bool is_of_applications = has_argument(pid, "-u");
    if (is_of_applications && process_name(pid) == "lttng-consumerd")
      known_.push_back(identity_of(pid));
  }
}

bool ConsumerDaemons::have_ended() const {
  return !known_.empty() && std::ranges::none_of(known_, is_running);
}

}  // namespace cie::record
