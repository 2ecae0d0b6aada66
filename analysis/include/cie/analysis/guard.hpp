// Runs a command in a child process that may be ended: libbabeltrace2 aborts or loops for ever on
// some damaged traces, and a report must say so instead of dying with it.
#pragma once

#include <functional>
#include <stdexcept>

namespace cie::analysis {

// The child was ended by a signal, or ended because it made no progress while reading.
class GuardedFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Forks and runs `command` in the child; returns its exit status. The child is ended when analyze()
// makes no progress for ten seconds of its CPU time or a minute of real time, or when it asks for
// more memory than half of the machine has. Signals that end the caller end the child. Throws
// GuardedFailure with a message for the user, std::system_error if forking fails. Call it from a
// single-threaded process only.
int run_guarded(const std::function<int()>& command);

}  // namespace cie::analysis
