// The process that reads a live session and analyses it, as its parent sees it.
#pragma once

#include "silence.hpp"

#include <chrono>
#include <optional>
#include <string>

#include <sys/types.h>

namespace cie {
class SchedulingSpec;
}

namespace cie::live {

struct FeedOptions {
  std::string url;                       // of a session, or of a relay daemon: all of its
  std::string watched{};                 // as Snapshot::watched
  const SchedulingSpec* spec = nullptr;  // borrowed; may be null
  std::chrono::milliseconds interval{1000};
  bool is_reconnecting = true;  // when the connection is lost
};

// A child process, because libbabeltrace2 aborts on some damaged input and waits for ever for a
// relay daemon that hangs: neither may take the terminal with it. It writes one line of cie.live/1
// per interval, with recent instances, and one more when the session ends; between them it says
// that it is alive.
class Feed {
 public:
  // Forks: create it before any thread. Throws std::system_error.
  explicit Feed(const FeedOptions& options);
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;

  // To poll for; -1 once everything was read.
  int descriptor() const noexcept { return descriptor_; }
  // Waits until the session is being followed: nothing written from now on is missed. False: the
  // process ended first, or half a minute was not enough; a line may tell why.
  bool wait_until_connected();
  // Reads what is there without waiting.
  void receive();
  // The next snapshot's line, or an error's, oldest first; empty if none is complete.
  std::optional<std::string> take_line();
  bool has_line() const noexcept { return buffer_.find('\n') != std::string::npos; }
  bool is_over() const noexcept { return descriptor_ < 0; }
  // For how long the process has waited for the relay daemon and said nothing, as far as was
  // listened. Once the lines were taken.
  Silence::Duration silence() const noexcept { return silence_.duration(); }
  // Why it ended, if that was not because the session did: for the user.
  std::string failure();

 private:
  pid_t pid_ = -1;
  int descriptor_ = -1;
  std::string buffer_;
  Silence silence_{Silence::Clock::now()};
};

// What the child does: reads until the session ends, nobody listens any more, or, if it is not to
// reconnect, the connection is lost. Returns the exit status of the process. Errors that end it are
// written as a line "error: TEXT".
int run_feed(const FeedOptions& options, int output);

}  // namespace cie::live
