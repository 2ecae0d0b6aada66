#include "keeping/live_keeping.hpp"

#include "base/machine.hpp"
#include "base/text.hpp"
#include "system/error.hpp"

#include <array>
#include <cerrno>
#include <csignal>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr milliseconds kListenInterval{100};
constexpr seconds kViewerPatience{30};
constexpr std::chrono::minutes kEndPatience{10};
constexpr seconds kCountInterval{1};

}  // namespace

LiveKeeping::LiveKeeping(const Options& options) : options_(options) {
  fcntl(options_.live_socket, F_SETFD, FD_CLOEXEC);  // the command's end would not be noticed
}

void LiveKeeping::tell(std::string line) const {
  line += '\n';
  // A peer that is gone is noticed when it is listened to.
  static_cast<void>(!::send(options_.live_socket, line.data(), line.size(), MSG_NOSIGNAL));
}

bool LiveKeeping::listen(milliseconds patience) {
  pollfd descriptor{.fd = options_.live_socket, .events = POLLIN, .revents = 0};
  if (::poll(&descriptor, 1, static_cast<int>(patience.count())) <= 0) return true;
  std::array<char, 64> text{};
  const auto size = read(options_.live_socket, text.data(), text.size());
  if (size <= 0) return size < 0 && errno == EINTR;
  received_.append(text.data(), static_cast<std::size_t>(size));
  return true;
}

bool LiveKeeping::begin() {
  daemon_ = std::make_unique<SessionDaemon>(options_.daemon);
  relay_ = std::make_unique<RelayDaemon>();
  const auto name = fmt::format("cie-live-{}", getpid());
  session_ = std::make_unique<TracingSession>(SessionKind::live, name, options_,
                                              RelayDestination{.control_url = relay_->control_url(),
                                                               .data_url = relay_->data_url(),
                                                               .interval = options_.live_interval});
  consumers_ = ConsumerDaemons(daemon_->pid());
  tell(fmt::format("url {}/host/{}/{}", relay_->live_url(), host_name(), name));
  const auto deadline = steady_clock::now() + kViewerPatience;
  while (received_.find('\n') == std::string::npos) {
    if (!listen(kListenInterval) || steady_clock::now() > deadline) return false;
  }
  session_->start();
  return true;
}

// How many applications are traced. Each question costs every one of them some time.
void LiveKeeping::look_for_applications() {
  if (applications_ > 0 || steady_clock::now() < next_look_) return;
  next_look_ = steady_clock::now() + kCountInterval;
  const auto count = session_->traced_processes().size();
  if (count != applications_) tell(fmt::format("applications {}", count));
  applications_ = count;
}

std::string LiveKeeping::ended_daemon() const {
  if (!daemon_->is_alive()) return "session daemon";
  if (!relay_->is_alive()) return "relay daemon";
  return consumers_.have_ended() ? "consumer daemon" : "";
}

void LiveKeeping::on_request(Target& target) { target.interrupt(SIGUSR1); }

void LiveKeeping::poll(Target& target) {
  if (const auto news = target.take_news()) tell("note " + *news);
  if (!is_wanted_) return;
  if (!listen(milliseconds{0})) {
    is_wanted_ = false;
    target.end();
    return;
  }
  look_for_applications();
  if (const auto daemon = ended_daemon(); !daemon.empty()) {
    target.interrupt(SIGTERM);
    throw RecordError("the " + daemon + " ended: nothing can be seen" +
                      (target.is_command() ? " of " + in_quotes(options_.command.front()) : "") +
                      " any more");
  }
}

Outcome LiveKeeping::finish(const std::optional<ExitStatus>& exit) {
  if (exit) tell(fmt::format("exit {} {}", options_.command.front(), describe(*exit)));
  session_->stop();
  Outcome outcome;
  outcome.options = options_;
  outcome.kept = KeptElsewhere{};
  outcome.manifest.channels = session_->losses();
  for (const RecordedChannel& loss : outcome.manifest.channels) {
    tell(fmt::format("lost {} {} {}", loss.name, loss.discarded_events, loss.lost_packets));
  }
  session_->destroy();
  // The reader is told that the session ended once it has read all, and closes its end then.
  // However slow it is: without the relay daemon it would miss the rest.
  const auto deadline = steady_clock::now() + kEndPatience;
  while (listen(kListenInterval) && steady_clock::now() < deadline) {
  }
  return outcome;
}

}  // namespace cie::record
