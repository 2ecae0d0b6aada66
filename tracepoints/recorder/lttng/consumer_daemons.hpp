// The processes that write, or send, what LTTng records of applications.
#pragma once

#include "system/processes.hpp"

#include <vector>

#include <sys/types.h>

namespace cie::record {

// Those of a session daemon, which tells of their end only who asks it for what needs them.
class ConsumerDaemons {
 public:
  ConsumerDaemons() = default;
  // Which the daemon has started by now; those of a session run as soon as it has channels. 0: none is known.
  explicit ConsumerDaemons(pid_t session_daemon);

  // Some are known, and all of these have ended.
  bool have_ended() const;

 private:
  std::vector<ProcessIdentity> known_;
};

}  // namespace cie::record
