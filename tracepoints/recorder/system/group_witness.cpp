#include "system/group_witness.hpp"

#include "base/machine.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <span>
#include <string_view>

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::record {
namespace {

// The kernel signals the members of a group one after the other, without a pause.
constexpr timespec kSoon{.tv_sec = 0, .tv_nsec = 20'000'000};
constexpr int kAnswerMs = 200;

constexpr std::string_view kName = "cie-witness";

// The words of this process's command line, as /proc shows them.
std::span<char> command_line() {
  constexpr int kBegin = 48;
  constexpr int kEnd = 49;
  const auto begin = stat_field("self", kBegin).value_or(0);
  const auto end = stat_field("self", kEnd).value_or(0);
  // NOLINTNEXTLINE(performance-no-int-to-ptr): an address, by the kernel's word
  return {reinterpret_cast<char*>(begin), end > begin ? end - begin : 0};
}

// Async-signal-safe calls only.
[[noreturn]] void witness(int connection, std::span<char> words) {
  // Who looks for the recorder by its name or its command line (pkill -f), is not to find two.
  prctl(PR_SET_NAME, kName.data());
  std::ranges::fill(words, '\0');
  std::ranges::copy(kName.substr(0, words.size()), words.begin());
  constexpr int kOwn = 3;
  if (connection != kOwn) dup2(connection, kOwn);
  close_range(kOwn + 1, ~0U, 0);
  for (int descriptor = 0; descriptor < kOwn; ++descriptor)
    close(descriptor);
  int number = 0;
  while (recv(kOwn, &number, sizeof number, 0) == sizeof number) {
    sigset_t asked;
    sigemptyset(&asked);
    sigaddset(&asked, number);
    const int seen = sigtimedwait(&asked, nullptr, &kSoon) == number ? 1 : 0;
    if (send(kOwn, &seen, sizeof seen, MSG_NOSIGNAL) < 0) break;
  }
  _exit(0);
}

}  // namespace

GroupWitness::GroupWitness() {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
    throw system_error("cannot create a socket", errno);
  connection_ = FileDescriptor(ends[0]);
  const FileDescriptor other(ends[1]);
  const std::span<char> words = command_line();
  pid_ = fork();
  if (pid_ < 0) throw system_error("cannot create a process", errno);
  if (pid_ == 0) witness(other.get(), words);
}

GroupWitness::~GroupWitness() {
  connection_ = FileDescriptor();
  while (waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<bool> GroupWitness::has_seen(int signal) const noexcept {
  pollfd answer{.fd = connection_.get(), .events = POLLIN, .revents = 0};
  int seen = 0;
  const bool is_told = send(connection_.get(), &signal, sizeof signal, MSG_NOSIGNAL) >= 0 &&
                       poll(&answer, 1, kAnswerMs) > 0 &&
                       recv(connection_.get(), &seen, sizeof seen, 0) == sizeof seen;
  return is_told ? std::optional(seen != 0) : std::nullopt;
}

}  // namespace cie::record
