#include "companion.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::live {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr seconds kUrlPatience{60};  // it may start daemons first
constexpr seconds kEndPatience{60};  // the command is to end first
constexpr milliseconds kPollInterval{10};
constexpr std::size_t kMaxPrinted = 16384;  // of what it prints nobody wants more than the end

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

Companion::Companion(const std::function<void(int socket)>& become, bool is_silent) {
  std::array<int, 2> sockets{};
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, sockets.data()) != 0) fail("cannot create a socket");
  std::array<int, 2> output{-1, -1};
  if (is_silent && ::pipe2(output.data(), O_CLOEXEC) != 0) fail("cannot create a pipe");
  ::fcntl(sockets[0], F_SETFD, FD_CLOEXEC);
  pid_ = ::fork();
  if (pid_ < 0) fail("cannot create a process");
  if (pid_ == 0) {
    if (is_silent) {
      ::dup2(output[1], STDERR_FILENO);
      const int null = ::open("/dev/null", O_RDONLY);
      ::dup2(null, STDIN_FILENO);
    }
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    std::signal(SIGPIPE, SIG_DFL);
    std::signal(SIGXFSZ, SIG_DFL);
    try {
      become(sockets[1]);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "cie live: %s\n", error.what());
    }
    ::_exit(127);
  }
  ::close(sockets[1]);
  socket_ = sockets[0];
  ::fcntl(socket_, F_SETFL, O_NONBLOCK);
  if (is_silent) {
    ::close(output[1]);
    output_ = output[0];
    ::fcntl(output_, F_SETFL, O_NONBLOCK);
  }
}

void Companion::end() noexcept {
  if (pid_ <= 0) return;
  if (socket_ >= 0) ::shutdown(socket_, SHUT_WR);
  const auto deadline = steady_clock::now() + kEndPatience;
  while (::waitpid(pid_, nullptr, WNOHANG) == 0) {
    receive();  // a full pipe must not hold it up
    if (steady_clock::now() > deadline) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
      break;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  pid_ = -1;
  receive();
  if (socket_ >= 0) ::close(socket_);
  if (output_ >= 0) ::close(output_);
  socket_ = output_ = -1;
}

std::string Companion::wait_for_url() {
  const auto deadline = steady_clock::now() + kUrlPatience;
  while (url_.empty() && socket_ >= 0 && steady_clock::now() < deadline) {
    pollfd descriptor{.fd = socket_, .events = POLLIN, .revents = 0};
    ::poll(&descriptor, 1, 100);
    receive();
  }
  if (!url_.empty()) return url_;
  receive_output();
  if (!failure_.empty()) throw std::runtime_error(failure_);
  throw std::runtime_error("cie-record did not start tracing" +
                           (printed_.empty() ? std::string() : ": " + printed_));
}

void Companion::start() {
  constexpr std::string_view kStart = "start\n";
  static_cast<void>(!::send(socket_, kStart.data(), kStart.size(), MSG_NOSIGNAL));
}

void Companion::signal(int number) const noexcept { ::kill(pid_, number); }

void Companion::receive_output() {
  std::array<char, 4096> part{};
  while (output_ >= 0) {
    const auto size = ::read(output_, part.data(), part.size());
    if (size > 0) {
      printed_.append(part.data(), static_cast<std::size_t>(size));
      if (printed_.size() > kMaxPrinted) printed_.erase(0, printed_.size() - kMaxPrinted);
      continue;
    }
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    ::close(output_);
    output_ = -1;
  }
}

void Companion::receive() {
  receive_output();
  std::array<char, 4096> part{};
  while (socket_ >= 0) {
    const auto size = ::read(socket_, part.data(), part.size());
    if (size > 0) {
      buffer_.append(part.data(), static_cast<std::size_t>(size));
      continue;
    }
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) break;
    ::close(socket_);
    socket_ = -1;
  }
  take_lines();
}

std::optional<std::string> Companion::take_note() {
  if (notes_.empty()) return std::nullopt;
  auto note = std::move(notes_.front());
  notes_.pop_front();
  return note;
}

void Companion::take_lines() {
  for (auto end = buffer_.find('\n'); end != std::string::npos; end = buffer_.find('\n')) {
    take(std::string_view(buffer_).substr(0, end));
    buffer_.erase(0, end + 1);
  }
}

void Companion::take(std::string_view line) {
  const auto space = std::min(line.find(' '), line.size());
  const auto word = line.substr(0, space);
  const auto rest = line.substr(std::min(space + 1, line.size()));
  if (word == "url") url_ = rest;
  if (word == "exit") command_end_ = rest;
  if (word == "failed") failure_ = rest;
  if (word == "note") notes_.emplace_back(rest);
  if (word == "applications") {
    std::uint64_t count = 0;
    std::from_chars(rest.data(), rest.data() + rest.size(), count);
    applications_ = count;
  }
  if (word == "lost" && !rest.ends_with(" 0 0")) {
    losses_ += (losses_.empty() ? "" : "; ") + std::string(rest);
  }
}

}  // namespace cie::live
