// Ctrl-C: SIGINT and SIGTERM end spinning.
#pragma once

#include <memory>
#include <vector>

namespace cie {

class Executor;
namespace scheduling {
class ExecutorCore;
}

// From construction to destruction SIGINT and SIGTERM cancel the executors given to it: spin()
// returns when the running callbacks have, and main() ends as it does without a signal. A signal
// that comes before spin() makes it return at once. The handler is async-signal-safe and keeps
// errno; system calls are restarted (SA_RESTART).
//
// Several may live at once, on any threads: a signal reaches all of them. The first one installs
// the handlers, and the destructor of the last puts the former ones back. Declare it before
// whatever must not be torn down by a second Ctrl-C. An executor may go before or after it. Must
// not be destroyed in a signal handler.
class CancelOnSignals {
 public:
  // Catches signals before there is an executor. Throws std::system_error.
  CancelOnSignals();
  explicit CancelOnSignals(Executor& executor);
  ~CancelOnSignals();
  CancelOnSignals(const CancelOnSignals&) = delete;
  CancelOnSignals& operator=(const CancelOnSignals&) = delete;

  // One more. It is cancelled at once if a signal came already.
  void add(Executor& executor);
  // Whether a signal came since the first of those that live now was made.
  bool is_requested() const noexcept;

 private:
  struct Entry;

  std::vector<Entry> entries_;
};

}  // namespace cie
