#include "session_daemon.hpp"

#include "error.hpp"
#include "processes.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <lttng/lttng.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr seconds kStartPatience{60};
constexpr seconds kOthersStartPatience{10};
constexpr seconds kStopPatience{30};
constexpr std::chrono::milliseconds kPollInterval{20};

// Where the shared daemon of this user keeps its sockets. LTTng 2.13 gives root no choice.
fs::path shared_run_directory() {
  if (geteuid() == 0) {
    return "/run/lttng";
  }
  for (const char* variable : {"LTTNG_HOME", "HOME"}) {
    if (const char* home = std::getenv(variable); home != nullptr && *home != '\0') {
      return fs::path(home) / ".lttng";
    }
  }
  throw RecordError("neither LTTNG_HOME nor HOME is set: LTTng needs one of them");
}

std::string tail_of(const fs::path& log_file) {
  std::ifstream file(log_file);
  std::string line;
  std::string last;
  while (std::getline(file, line)) {
    if (!line.empty()) {
      last = line;
    }
  }
  return last;
}

bool is_running(pid_t pid) { return pid > 0 && (kill(pid, 0) == 0 || errno == EPERM); }

void wait_for_end(pid_t pid, std::optional<ChildProcess>& child) {
  const auto deadline = steady_clock::now() + kStopPatience;
  while (steady_clock::now() < deadline) {
    if (child && child->pid() == pid ? child->poll().has_value() : !is_running(pid)) {
      return;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  kill(pid, SIGKILL);
}

// The pid comes from a file, so it may be another process's by now.
bool is_session_daemon(pid_t pid) { return process_name(pid) == "lttng-sessiond"; }

// Locks of one byte each that belong to the open file: released when it is closed.
constexpr off_t kDecision = 0;
constexpr off_t kUse = 1;

bool change_lock(int file, off_t byte, short type, int command) noexcept {
  struct flock range {};
  range.l_type = type;
  range.l_whence = SEEK_SET;
  range.l_start = byte;
  range.l_len = 1;
  int result = 0;
  do {
    result = fcntl(file, command, &range);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

bool lock(int file, off_t byte, short type) noexcept {
  return change_lock(file, byte, type, F_OFD_SETLKW);
}

bool try_lock(int file, off_t byte, short type) noexcept {
  return change_lock(file, byte, type, F_OFD_SETLK);
}

// Hides the machine's /run/lttng from this process and its children. Mounts that others make later
// still appear here; ours never appear there. Returns an errno, 0 if done.
int make_run_directory_private() noexcept {
  constexpr const char* kRun = "/run/lttng";
  if (unshare(CLONE_NEWNS) != 0) return errno;
  if (mount(nullptr, "/", nullptr, MS_REC | MS_SLAVE, nullptr) != 0) return errno;
  if (mkdir(kRun, 0755) != 0 && errno != EEXIST) return errno;
  if (mount("tmpfs", kRun, "tmpfs", MS_NOSUID | MS_NODEV, "mode=0755") != 0) return errno;
  return 0;
}

bool has_sessions() {
  lttng_session* sessions = nullptr;
  const int count = lttng_list_sessions(&sessions);
  std::free(sessions);
  return count > 0;
}

}  // namespace

SessionDaemon::SessionDaemon(DaemonChoice choice) : choice_(choice) {
  if (choice != DaemonChoice::shared && geteuid() == 0) {
    const auto error = make_run_directory_private();
    if (error && choice == DaemonChoice::own) {
      throw system_error("cannot give root a session daemon of its own (a mount namespace)", error);
    }
    choice_ = error ? DaemonChoice::shared : DaemonChoice::own;
  } else if (choice == DaemonChoice::own_if_possible) {
    choice_ = DaemonChoice::own;
  }
  if (choice_ == DaemonChoice::own) {
    start_own();
  } else {
    find_or_start_shared();
  }
}

SessionDaemon::~SessionDaemon() {
  if (choice_ == DaemonChoice::shared) {
    stop_if_unused();
  } else if (process_) {
    process_->kill(SIGTERM);
    wait_for_end(process_->pid(), process_);
  }
  if (!home_.empty()) {
    std::error_code ignored;  // a left-over directory of a few sockets is not worth a failure
    fs::remove_all(home_, ignored);
  }
}

bool SessionDaemon::is_alive() const { return lttng_session_daemon_alive() == 1; }

void SessionDaemon::abandon() noexcept {
  if (process_ && !process_->poll()) {
    kill(-process_->pid(), SIGKILL);  // it leads a process group
    wait_for_end(process_->pid(), process_);
  }
  process_.reset();
  lock_.reset();
}

void SessionDaemon::start_own() {
  // Short, because it is part of the names of Unix sockets (108 bytes).
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  std::string home = (runtime != nullptr && access(runtime, W_OK) == 0 ? std::string(runtime)
                                                                       : std::string("/tmp")) +
                     "/cie-record-XXXXXX";
  if (mkdtemp(home.data()) == nullptr) {
    throw system_error("cannot create a directory like " + in_quotes(home), errno);
  }
  home_ = home;
  setenv("LTTNG_HOME", home.c_str(), 1);
  // liblttng-ctl prefers root's daemon for members of the tracing group; this name has no members.
  lttng_set_tracing_group("cie-record-own");
  start(home_ / "sessiond.log", true);
}

// Two locks in one file. kDecision serialises starting and stopping; kUse is held shared by every
// recorder that uses the daemon, so whoever can take it exclusively is the last one. The file's
// text is the pid of the daemon if a recorder started it.
void SessionDaemon::find_or_start_shared() {
  const fs::path directory = shared_run_directory();
  if (lttng_session_daemon_alive() == 1 && access(directory.c_str(), W_OK) != 0) {
    return;  // root's, through the tracing group: not ours to stop
  }
  std::error_code error;
  fs::create_directories(directory, error);
  const fs::path lock_file = directory / "cie-record.lock";
  lock_ = FileDescriptor(open(lock_file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  if (!lock_.is_open()) {
    throw system_error("cannot open " + in_quotes(lock_file), errno);
  }
  lock(lock_.get(), kDecision, F_WRLCK);
  lock(lock_.get(), kUse, F_RDLCK);
  if (lttng_session_daemon_alive() != 1) {
    const fs::path log_file = directory / "cie-record-sessiond.log";
    fs::remove(log_file, error);
    start(log_file, false);
    const std::string pid = process_ ? std::to_string(process_->pid()) + '\n' : std::string();
    if (ftruncate(lock_.get(), 0) != 0 ||
        pwrite(lock_.get(), pid.data(), pid.size(), 0) != static_cast<ssize_t>(pid.size())) {
      throw system_error("cannot write " + in_quotes(lock_file), errno);
    }
  }
  lock(lock_.get(), kDecision, F_UNLCK);
}

void SessionDaemon::start(const fs::path& log_file, bool is_own) {
  const char* program = std::getenv("LTTNG_SESSIOND_PATH");
  try {
    process_.emplace(
        std::vector<std::string>{program != nullptr ? program : "lttng-sessiond", "--no-kernel"},
        ChildOptions{.environment = {},
                     .is_detached = true,
                     .dies_with_parent = is_own,
                     .log_file = log_file});
  } catch (const RecordError& error) {
    throw RecordError(std::string(error.what()) +
                      " (the session daemon of LTTng: install lttng-tools)");
  }
  auto deadline = steady_clock::now() + kStartPatience;
  bool has_ended = false;
  while (true) {
    // One that finds another, which somebody else started meanwhile, ends by itself.
    if (!has_ended && process_->poll()) {
      has_ended = true;
      deadline = steady_clock::now() + (is_own ? seconds{0} : kOthersStartPatience);
    }
    if (lttng_session_daemon_alive() == 1) {
      break;
    }
    if (steady_clock::now() > deadline) {
      throw RecordError("the session daemon of LTTng did not start: " + tail_of(log_file));
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  if (has_ended) {
    process_.reset();
  }
}

void SessionDaemon::stop_if_unused() noexcept {
  if (!lock_.is_open() || !lock(lock_.get(), kDecision, F_WRLCK) ||
      !try_lock(lock_.get(), kUse, F_WRLCK)) {
    return;
  }
  char text[32] = {};
  if (pread(lock_.get(), text, sizeof text - 1, 0) <= 0) {
    return;
  }
  const auto pid = static_cast<pid_t>(std::strtol(text, nullptr, 10));
  if (is_session_daemon(pid) && lttng_session_daemon_alive() == 1 && !has_sessions()) {
    kill(pid, SIGTERM);
    wait_for_end(pid, process_);
    static_cast<void>(!ftruncate(lock_.get(), 0));
  }
}

}  // namespace cie::record
