#include "live_stream.hpp"

#include "child_process.hpp"
#include "error.hpp"
#include "manifest.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <exception>
#include <string>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr milliseconds kTick{100};
constexpr seconds kStartPatience{30};
constexpr std::chrono::minutes kEndPatience{10};
constexpr seconds kLookInterval{1};

void tell_peer(int socket, std::string line) {
  line += '\n';
  // A peer that is gone is noticed when it is listened to.
  static_cast<void>(!::send(socket, line.data(), line.size(), MSG_NOSIGNAL));
}

}  // namespace

bool stream_live(Options options) {
  const int socket = options.live_socket;
  try {
    LiveStream(std::move(options)).run();
    return true;
  } catch (const std::exception& error) {
    tell_peer(socket, std::string("failed ") + error.what());
    return false;
  }
}

LiveStream::LiveStream(Options options) : options_(std::move(options)) {
  fcntl(options_.live_socket, F_SETFD, FD_CLOEXEC);  // the command's end would not be noticed
  daemon_ = std::make_unique<SessionDaemon>(options_.daemon);
  relay_ = std::make_unique<RelayDaemon>();
  const auto name = "cie-live-" + std::to_string(getpid());
  session_ = std::make_unique<TracingSession>(name, options_,
                                              RelayDestination{.control_url = relay_->control_url(),
                                                               .data_url = relay_->data_url(),
                                                               .interval = options_.live_interval,
                                                               .keeps_all = false});
  tell("url " + relay_->live_url() + "/host/" + host_name() + '/' + name);
}

void LiveStream::tell(const std::string& line) { tell_peer(options_.live_socket, line); }

bool LiveStream::listen(milliseconds patience) {
  pollfd descriptor{.fd = options_.live_socket, .events = POLLIN, .revents = 0};
  if (poll(&descriptor, 1, static_cast<int>(patience.count())) <= 0) return true;
  std::array<char, 64> text{};
  const auto size = read(options_.live_socket, text.data(), text.size());
  if (size <= 0) return size < 0 && errno == EINTR;
  received_.append(text.data(), static_cast<std::size_t>(size));
  return true;
}

void LiveStream::run() {
  const auto deadline = steady_clock::now() + kStartPatience;
  while (received_.find('\n') == std::string::npos) {
    if (!listen(kTick) || steady_clock::now() > deadline) return;  // nobody wants it any more
  }
  session_->start();
  if (options_.is_attach()) {
    wait_attached();
  } else {
    run_command();
  }
  finish();
}

// How many applications are traced. Each question costs every one of them some time.
void LiveStream::look_for_applications() {
  if (applications_ > 0 || steady_clock::now() < next_look_) return;
  next_look_ = steady_clock::now() + kLookInterval;
  const auto count = session_->traced_processes().size();
  if (count != applications_) tell("applications " + std::to_string(count));
  applications_ = count;
}

void LiveStream::run_command() {
  ChildOptions child_options;
  child_options.environment.emplace_back("LTTNG_UST_REGISTER_TIMEOUT", "-1");
  child_options.dies_with_parent = true;
  ChildProcess command(options_.command, child_options);
  bool is_wanted = true;
  while (!command.poll()) {
    const auto signal = signals_.wait(kTick);
    if (signal && signal->number != SIGCHLD && !signal->is_from_terminal) {
      command.kill(signal->number);
    }
    if (is_wanted && !listen(milliseconds{0})) {
      is_wanted = false;
      command.kill(SIGTERM);
    }
    look_for_applications();
    if (!daemon_->is_alive() || !relay_->is_alive()) {
      command.kill(SIGTERM);
      throw RecordError("a daemon of LTTng ended: nothing can be seen of " +
                        in_quotes(options_.command.front()) + " any more");
    }
  }
  tell("exit " + options_.command.front() + ' ' + describe(*command.poll()));
}

void LiveStream::wait_attached() {
  while (listen(milliseconds{0})) {
    const auto signal = signals_.wait(kTick);
    if (signal && signal->number != SIGCHLD) return;
    look_for_applications();
    if (!daemon_->is_alive() || !relay_->is_alive()) {
      throw RecordError("a daemon of LTTng ended: nothing can be seen any more");
    }
  }
}

void LiveStream::finish() {
  session_->stop();
  for (const auto& loss : session_->losses()) {
    tell("lost " + loss.name + ' ' + std::to_string(loss.discarded_events) + ' ' +
         std::to_string(loss.lost_packets));
  }
  session_->destroy();
  // The reader is told that the session ended once it has read all, and closes its end then.
  // However slow it is: without the relay daemon it would miss the rest.
  const auto deadline = steady_clock::now() + kEndPatience;
  while (listen(kTick) && steady_clock::now() < deadline) {
  }
}

}  // namespace cie::record
