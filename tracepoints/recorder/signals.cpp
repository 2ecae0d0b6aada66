#include "signals.hpp"

#include "error.hpp"

#include <cerrno>
#include <csignal>

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

}  // namespace

Signals::Signals() {
  const sigset_t signals = listened_to();
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  descriptor_ = FileDescriptor(signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK));
  if (!descriptor_.is_open()) {
    throw system_error("cannot create a signalfd", errno);
  }
}

Signals::~Signals() {
  const sigset_t signals = listened_to();
  while (wait(std::chrono::milliseconds(0))) {
  }
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
