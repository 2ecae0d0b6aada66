// The threads that libraries start while one calls them.
#pragma once

#include <csignal>
#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace cie::scheduling {

// Those that the calling thread starts while this lives, whatever others start meanwhile: it blocks all
// signals but SIGXCPU, which nobody else does, and a thread begins with the mask of who starts it.
// Cyclone DDS gives its threads this mask anyway.
class StartedThreads {
 public:
  StartedThreads();
  StartedThreads(const StartedThreads&) = delete;
  StartedThreads& operator=(const StartedThreads&) = delete;
  ~StartedThreads();

  // As they call themselves. A new thread does so when it comes to run; this waits for those that
  // still carry the caller's name: ten seconds for one that lacks a CPU, briefly for one that sleeps
  // under that name. On the same thread.
  std::vector<std::pair<std::uint32_t, std::string>> named() const;

 private:
  const std::set<std::uint32_t> before_;
  sigset_t former_{};
};

}  // namespace cie::scheduling
