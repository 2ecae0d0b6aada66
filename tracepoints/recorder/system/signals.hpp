// The signals the recorder listens to, as events instead of handlers.
#pragma once

#include "base/file_descriptor.hpp"

#include <chrono>
#include <optional>

namespace cie::record {

struct ReceivedSignal {
  int number = 0;
  // Sent by the kernel, as a terminal's are (Ctrl-C): the whole foreground process group has got it.
  bool is_from_terminal = false;
};

// Blocks SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1 and SIGCHLD for its lifetime, and SIGPIPE and
// SIGXFSZ, which it does not listen to. Create it before any thread.
class Signals {
 public:
  Signals();
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  // Waits for one of them; empty when the time is over.
  std::optional<ReceivedSignal> wait(std::chrono::milliseconds timeout);

 private:
  FileDescriptor descriptor_;
};

}  // namespace cie::record
