#include "end_in_time.hpp"

#include "base/program.hpp"

#include <cerrno>
#include <chrono>
#include <string_view>
#include <system_error>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace cie::container {
namespace {

using std::chrono::steady_clock;

constexpr std::array<int, 2> kSignals{SIGINT, SIGTERM};
constexpr std::chrono::milliseconds kTimeToEnd{800};
constexpr std::chrono::milliseconds kLook{50};

// Of the one there is, for the handler.
std::atomic<int> signalled{-1};
std::array<void (*)(int), kSignals.size()> passed_to{};

FileDescriptor opened(int descriptor) {
  if (descriptor < 0) throw std::system_error{errno, std::generic_category(), "eventfd"};
  return FileDescriptor{descriptor};
}

bool is_ready(const FileDescriptor& descriptor, std::chrono::milliseconds patience) {
  pollfd wanted{.fd = descriptor.get(), .events = POLLIN, .revents = 0};
  return poll(&wanted, 1, static_cast<int>(patience.count())) > 0;
}

[[noreturn]] void end_by_force() {
  constexpr std::string_view kWhy =
      "cie-run: ended by force: a second after the signal a component still loads, or an order is "
      "still in progress\n";
  static_cast<void>(!write(STDERR_FILENO, kWhy.data(), kWhy.size()));
  _exit(kFailed);
}

}  // namespace

void EndInTime::on_signal(int number) {
  const int error = errno;
  const auto at = static_cast<std::size_t>(number == kSignals[0] ? 0 : 1);
  if (passed_to[at] != SIG_DFL && passed_to[at] != SIG_IGN) passed_to[at](number);
  eventfd_write(signalled, 1);
  errno = error;
}

EndInTime::EndInTime()
    : signalled_(opened(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))),
      stop_(opened(eventfd(0, EFD_CLOEXEC))) {
  signalled = signalled_.get();
  thread_.emplace("cie-end", [this] { watch(); });
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], nullptr, &former_[i]);
    passed_to[i] = former_[i].sa_handler;
    struct sigaction action = former_[i];
    action.sa_handler = on_signal;
    sigaction(kSignals[i], &action, nullptr);
  }
}

EndInTime::~EndInTime() {
  for (std::size_t i = 0; i < kSignals.size(); ++i)
    sigaction(kSignals[i], &former_[i], nullptr);
  eventfd_write(stop_.get(), 1);
}

void EndInTime::watch() {
  std::array<pollfd, 2> wanted{{{.fd = stop_.get(), .events = POLLIN, .revents = 0},
                                {.fd = signalled_.get(), .events = POLLIN, .revents = 0}}};
  while (poll(wanted.data(), wanted.size(), -1) < 0) {  // EINTR
  }
  auto deadline = steady_clock::now() + kTimeToEnd;
  while (!is_ready(stop_, kLook)) {
    if (is_patient_) {
      deadline = steady_clock::now() + kTimeToEnd;
    } else if (steady_clock::now() >= deadline) {
      end_by_force();
    }
  }
}

}  // namespace cie::container
