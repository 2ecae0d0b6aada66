// Which signals threads leave to others.
#pragma once

#include <csignal>
#include <span>

namespace cie::scheduling {

// Blocks all signals but some in the calling thread, for as long as this lives. Threads that it
// starts begin with that.
class SignalsBlocked {
 public:
  explicit SignalsBlocked(std::span<const int> but) noexcept {
    sigset_t blocked;
    sigfillset(&blocked);
    for (const int signal : but)
      sigdelset(&blocked, signal);
    pthread_sigmask(SIG_BLOCK, &blocked, &former_);
  }
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &former_, nullptr); }

 private:
  sigset_t former_{};
};

}  // namespace cie::scheduling
