#include <cie/executor/on_hangup.hpp>
#include <cie/tracepoints/background_thread.hpp>

#include "base/file_descriptor.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <optional>
#include <system_error>
#include <utility>

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

namespace cie {
namespace {

sigset_t hangup() noexcept {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGHUP);
  return set;
}

FileDescriptor opened(int descriptor, const char* what) {
  if (descriptor < 0) throw std::system_error{errno, std::generic_category(), what};
  return FileDescriptor{descriptor};
}

}  // namespace

void hold_hangups() {
  const sigset_t set = hangup();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

class OnHangup::Impl {
 public:
  explicit Impl(std::function<void()> function) : function_(std::move(function)) {
    thread_.emplace("cie-hangup", [this] { run(); });
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { eventfd_write(stop_.get(), 1); }

 private:
  static int open_signals() noexcept {
    const sigset_t set = hangup();
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  }

  void run() noexcept {
    for (;;) {
      std::array<pollfd, 2> ready{{{.fd = stop_.get(), .events = POLLIN, .revents = 0},
                                   {.fd = signals_.get(), .events = POLLIN, .revents = 0}}};
      if (poll(ready.data(), ready.size(), -1) < 0) continue;
      if (ready[0].revents != 0) return;
      signalfd_siginfo info{};
      if (read(signals_.get(), &info, sizeof info) == sizeof info) function_();
    }
  }

  std::function<void()> function_;
  FileDescriptor stop_ = opened(eventfd(0, EFD_CLOEXEC), "eventfd");
  FileDescriptor signals_ = opened(open_signals(), "signalfd");
  std::optional<BackgroundThread> thread_;  // last: it uses all of them
};

OnHangup::OnHangup(std::function<void()> function)
    : impl_(std::make_unique<Impl>(std::move(function))) {}
OnHangup::~OnHangup() = default;

}  // namespace cie
