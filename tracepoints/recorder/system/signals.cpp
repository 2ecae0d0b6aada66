#include "system/signals.hpp"

#include "system/error.hpp"

#include <cerrno>
#include <csignal>
#include <ctime>

#include <poll.h>
#include <sys/signalfd.h>

namespace cie::record {
namespace {

sigset_t listened_to() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGCHLD}) {
    sigaddset(&signals, signal);
  }
  return signals;
}

// A daemon of LTTng that fails closes its connections, and files may have a limit of size: what writes
// is told so, and goes on.
sigset_t put_off() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGPIPE);
  sigaddset(&signals, SIGXFSZ);
  return signals;
}

}  // namespace

Signals::Signals() {
  const sigset_t signals = listened_to();
  const sigset_t broken = put_off();
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  sigprocmask(SIG_BLOCK, &broken, nullptr);
  descriptor_ = FileDescriptor(signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!descriptor_.is_open()) {
    throw system_error("cannot create a signalfd", errno);
  }
}

Signals::~Signals() {
  const sigset_t signals = listened_to();
  while (wait(std::chrono::milliseconds(0))) {
  }
  const sigset_t broken = put_off();
  const timespec at_once{};
  while (sigtimedwait(&broken, nullptr, &at_once) > 0) {
  }
  sigprocmask(SIG_UNBLOCK, &broken, nullptr);
  sigprocmask(SIG_UNBLOCK, &signals, nullptr);
}

std::optional<ReceivedSignal> Signals::wait(std::chrono::milliseconds timeout) {
  pollfd descriptor{.fd = descriptor_.get(), .events = POLLIN, .revents = 0};
  if (poll(&descriptor, 1, static_cast<int>(timeout.count())) <= 0) {
    return std::nullopt;
  }
  signalfd_siginfo info{};
  if (read(descriptor_.get(), &info, sizeof info) != sizeof info) {
    return std::nullopt;
  }
  return ReceivedSignal{.number = static_cast<int>(info.ssi_signo),
                        .is_from_terminal = info.ssi_code == SI_KERNEL};
}

}  // namespace cie::record
