// The outcome of asking the kernel for something.
#pragma once

#include <string>

namespace cie::scheduling {

// error 0: everything was accepted.
struct SchedRequest {
  int error = 0;
  std::string what{};    // the refused request: "SCHED_FIFO 80", "CPUs 0,1"
  std::string reason{};  // the kernel's word and the remedy
};

}  // namespace cie::scheduling
