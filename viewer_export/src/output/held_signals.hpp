// Signals that would end the program wait while something half done could not be undone.
#pragma once

#include <csignal>

#include <pthread.h>

namespace cie::viewer_export {

// Holds SIGINT, SIGTERM and SIGHUP back from the calling thread while it lives.
class HeldSignals {
 public:
  HeldSignals() noexcept {
    sigset_t ending{};
    sigemptyset(&ending);
    for (const int number : {SIGINT, SIGTERM, SIGHUP})
      sigaddset(&ending, number);
    pthread_sigmask(SIG_BLOCK, &ending, &before_);
  }
  ~HeldSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;

 private:
  sigset_t before_{};
};

}  // namespace cie::viewer_export
