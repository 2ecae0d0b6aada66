#include "feed.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/live_reader.hpp>

#include "monitor.hpp"
#include "pace.hpp"
#include "sessions.hpp"
#include "snapshot_json.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <ctime>
#include <memory>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::live {
namespace {

using analysis::LiveReader;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kIdle{10};
constexpr milliseconds kBeforeReconnecting{1000};
constexpr int kMostEarlyFailures = 20;
// Lines beside those of snapshots. The first one of all:
constexpr std::string_view kConnected = "connected";
// the relay daemon answers, even if nothing is to be shown yet;
constexpr std::string_view kAlive = "alive";
// until the next line the relay daemon is not listened to.
constexpr std::string_view kLooking = "looking";
constexpr std::chrono::seconds kSignInterval{1};
// What is not answered for so long is told as no answer, or soon will be.
constexpr std::chrono::seconds kLongStep{2};
constexpr std::chrono::seconds kConnectPatience{30};

bool write_line(int output, std::string_view text) {
  std::string line(text);
  line += '\n';
  std::size_t done = 0;
  while (done < line.size()) {
    const auto size = ::write(output, line.data() + done, line.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return false;
    done += static_cast<std::size_t>(size);
  }
  return true;
}

// Of this thread.
std::chrono::nanoseconds cpu_time() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds{time.tv_sec} + std::chrono::nanoseconds{time.tv_nsec};
}

// The analysis of one session or of all there are, over as many connections as it takes.
class Watch {
 public:
  Watch(const FeedOptions& options, int output)
      : options_(options),
        output_(output),
        analyzer_({.spec = options.spec, .allow_crash = true, .is_live = true}, &monitor_),
        sessions_(options.url, analyzer_),
        pace_(options.interval, steady_clock::now()) {}

  // False: nobody listens any more.
  bool run() {
    for (;;) {
      try {
        if (!follow()) return false;
        sessions_.finish();
        show(SourceState::ended);
        return true;
      } catch (const analysis::UnreadableTrace& error) {
        if (!has_connected_) throw;
        if (may_try_at_once()) continue;
        if (!options_.is_reconnecting) throw;
        message_ = error.what();
      }
      if (!show(SourceState::lost)) return false;
      std::this_thread::sleep_for(kBeforeReconnecting);
    }
  }

 private:
  // While a session's first packets come, the relay daemon may fail to find the metadata that it
  // has just been sent. Nothing has been read then, so nothing is lost.
  bool may_try_at_once() {
    if (early_failures_ == kMostEarlyFailures || analyzer_.look().report.trace.events > 0) {
      return false;
    }
    ++early_failures_;
    std::this_thread::sleep_for(kIdle);
    return true;
  }

  // Until what is followed ends; false: nobody listens any more.
  bool follow() {
    for (;;) {
      const auto begun = steady_clock::now();
      const auto step = sessions_.step();
      message_.clear();
      if (!std::exchange(has_connected_, true) && !write_line(output_, kConnected)) return false;
      const auto now = steady_clock::now();
      if (now - begun > kLongStep) pace_.hasten(now);
      if (pace_.is_due(now)) {
        if (!show(std::nullopt)) return false;
      } else if (now >= next_sign_) {
        if (!write_line(output_, kAlive)) return false;
        next_sign_ = now + kSignInterval;
      }
      if (step == LiveReader::Step::end) return true;
      if (step == LiveReader::Step::nothing) std::this_thread::sleep_for(kIdle);
    }
  }

  // False: nobody listens any more.
  bool show(std::optional<SourceState> state) {
    if (!write_line(output_, kLooking)) return false;
    const auto before = cpu_time();
    const auto line =
        line_of(state == SourceState::ended ? analyzer_.finish() : analyzer_.look(), state);
    pace_.looked(steady_clock::now(), cpu_time() - before);
    return write_line(output_, line);
  }

  std::string line_of(const analysis::AnalysisResult& result, std::optional<SourceState> state) {
    auto snapshot = monitor_.describe(result, steady_clock::now());
    const auto why_lost = sessions_.why_lost();
    if (state || why_lost) snapshot.state = state.value_or(SourceState::lost);
    snapshot.source = options_.url;
    snapshot.watched = options_.watched;
    snapshot.message = message_.empty() ? why_lost.value_or("") : message_;
    snapshot.hosts = sessions_.hosts(result.report);
    return json_line(snapshot, true);
  }

  FeedOptions options_;
  int output_;
  Monitor monitor_;
  analysis::Analyzer analyzer_;
  Sessions sessions_;
  bool has_connected_ = false;
  int early_failures_ = 0;
  std::string message_;
  Pace pace_;
  steady_clock::time_point next_sign_{};
};

}  // namespace

int run_feed(const FeedOptions& options, int output) {
  try {
    Watch watch(options, output);
    watch.run();
    return 0;
  } catch (const std::exception& error) {
    write_line(output, std::string("error: ") + error.what());
    return 1;
  }
}

Feed::Feed(const FeedOptions& options) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "cannot create a pipe");
  }
  pid_ = ::fork();
  if (pid_ < 0) {
    throw std::system_error(errno, std::generic_category(), "cannot create a process");
  }
  if (pid_ == 0) {
    ::close(ends[0]);
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // The parent decides when it is over; SIGPIPE must not look like a crash.
    for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGTSTP})
      std::signal(number, SIG_IGN);
    const int null = ::open("/dev/null", O_RDWR);
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
      ::dup2(null, descriptor);
    ::_exit(run_feed(options, ends[1]));
  }
  ::close(ends[1]);
  descriptor_ = ends[0];
  ::fcntl(descriptor_, F_SETFL, O_NONBLOCK);
}

Feed::~Feed() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
}

bool Feed::wait_until_connected() {
  const auto deadline = steady_clock::now() + kConnectPatience;
  while (!is_over() && steady_clock::now() < deadline) {
    pollfd descriptor{.fd = descriptor_, .events = POLLIN, .revents = 0};
    ::poll(&descriptor, 1, 100);
    receive();
    if (buffer_.find('\n') == std::string::npos) continue;
    if (!buffer_.starts_with(kConnected)) return false;
    take_line();
    return true;
  }
  return false;
}

void Feed::receive() {
  silence_.listen(steady_clock::now());
  std::array<char, 65536> part{};
  while (descriptor_ >= 0) {
    const auto size = ::read(descriptor_, part.data(), part.size());
    if (size > 0) {
      buffer_.append(part.data(), static_cast<std::size_t>(size));
      continue;
    }
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    ::close(descriptor_);
    descriptor_ = -1;
  }
}

std::optional<std::string> Feed::take_line() {
  for (auto end = buffer_.find('\n'); end != std::string::npos; end = buffer_.find('\n')) {
    auto line = buffer_.substr(0, end);
    buffer_.erase(0, end + 1);
    silence_.heard(line == kLooking);
    if (line != kLooking && line != kAlive) return line;
  }
  return std::nullopt;
}

std::string Feed::failure() {
  int status = 0;
  if (pid_ <= 0 || ::waitpid(pid_, &status, 0) != pid_) return {};
  pid_ = -1;
  if (WIFSIGNALED(status)) {
    return "the process that reads the session was ended by signal " +
           std::to_string(WTERMSIG(status));
  }
  return WEXITSTATUS(status) == 0 ? "" : "the session cannot be read any more";
}

}  // namespace cie::live
