#include "lttng/session_daemon.hpp"

#include "base/text.hpp"
#include "system/error.hpp"
#include "system/processes.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <lttng/lttng.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using std::chrono::steady_clock;

constexpr seconds kStartPatience{60};
constexpr seconds kOthersStartPatience{10};
constexpr seconds kRegistrationPatience{10};
constexpr seconds kStopPatience{30};
constexpr seconds kGivenUpPatience{3};
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

// The pid comes from a file, so it may be another process's by now.
bool is_session_daemon(pid_t pid) { return process_name(pid) == "lttng-sessiond"; }

// Not open: nobody listens there.
FileDescriptor connected_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};
  path.copy(address.sun_path, path.size());
  FileDescriptor client(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const bool is_heard =
      client.is_open() &&
      connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  return is_heard ? std::move(client) : FileDescriptor{};
}

// The process that listens where clients of LTTng connect; 0: nobody, or of another pid namespace.
pid_t answering_daemon(const fs::path& run_directory) {
  const auto client = connected_to(run_directory / "client-lttng-sessiond");
  ucred peer{};
  socklen_t size = sizeof peer;
  const bool is_known =
      client.is_open() && getsockopt(client.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0;
  return is_known ? peer.pid : 0;
}

// Whether applications can register, by whichever version of LTTng-UST.
bool hears_applications(const fs::path& run_directory) {
  std::error_code error;
  fs::directory_iterator entry(run_directory, error);
  for (const fs::directory_iterator end; !error && entry != end; entry.increment(error)) {
    const bool is_for_applications =
        entry->path().filename().string().starts_with("lttng-ust-sock-");
    if (is_for_applications && connected_to(entry->path()).is_open()) return true;
  }
  return false;
}

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

// The pid that the file names: of the daemon if a recorder started it; 0: none did.
pid_t started_daemon(int file) noexcept {
  char text[32] = {};
  return pread(file, text, sizeof text - 1, 0) > 0
             ? static_cast<pid_t>(std::strtol(text, nullptr, 10))
             : 0;
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

// Of this process; other recorders hold a lock. One that failed may take its time to go.
bool is_own(const lttng_session& session) {
  const std::string_view name = session.name;
  return name.starts_with("cie-") && name.find(fmt::format("-{}", getpid())) != name.npos;
}

bool has_others_sessions() {
  lttng_session* sessions = nullptr;
  const int count = lttng_list_sessions(&sessions);
  const bool has_any = count > 0 && !std::all_of(sessions, sessions + count, is_own);
  std::free(sessions);
  return has_any;
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
  try {
    if (choice_ == DaemonChoice::own) {
      start_own();
    } else {
      find_or_start_shared();
    }
  } catch (...) {
    give_up();
    if (process_) stop();
    throw;
  }
}

SessionDaemon::~SessionDaemon() {
  if (choice_ == DaemonChoice::shared) {
    stop_if_unused();
  } else if (process_) {
    stop();
  }
}

void SessionDaemon::abandon_process() noexcept {
  if (process_) process_->end_group(std::chrono::milliseconds{0});
  process_.reset();
}

// With its consumer daemons and whatever else it started: a session daemon that fails, or has to be
// killed, leaves those behind.
void SessionDaemon::stop() noexcept {
  process_->kill(SIGTERM);
  process_->end_group(has_given_up_ ? kGivenUpPatience : kStopPatience);
  process_.reset();
}

bool SessionDaemon::is_alive() const { return lttng_session_daemon_alive() == 1; }

// Where it answers is known as liblttng-ctl knows it; root's is for members of the tracing group, too.
pid_t SessionDaemon::pid() const {
  const bool is_others = !process_ && access(shared_run_directory().c_str(), W_OK) != 0;
  return answering_daemon(is_others ? fs::path("/run/lttng") : shared_run_directory());
}

void SessionDaemon::abandon() noexcept {
  abandon_process();
  lock_.close();
}

void SessionDaemon::start_own() {
  // Short, because it is part of the names of Unix sockets (108 bytes).
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  const bool has_runtime = runtime != nullptr && access(runtime, W_OK) == 0;
  home_.emplace(has_runtime ? runtime : "/tmp", "cie-record-");
  setenv("LTTNG_HOME", home_->path().c_str(), 1);
  // liblttng-ctl prefers root's daemon for members of the tracing group; this name has no members.
  lttng_set_tracing_group("cie-record-own");
  start(home_->path() / "sessiond.log", true);
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
    // One that a recorder started and that nobody can reach any more.
    const pid_t left = started_daemon(lock_.get());
    if (left > 0 && is_session_daemon(left)) end_process(left, kGivenUpPatience);
    const fs::path log_file = directory / "cie-record-sessiond.log";
    fs::remove(log_file, error);
    start(log_file, false);
    const std::string pid = process_ ? fmt::format("{}\n", process_->pid()) : std::string();
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
                     .outlives_file_limit = true,
                     .log_file = log_file});
  } catch (const RecordError& error) {
    throw RecordError(std::string(error.what()) +
                      " (the session daemon of LTTng: install lttng-tools)");
  }
  if (home_) home_->note_daemon(process_->pid());
  auto deadline = steady_clock::now() + kStartPatience;
  bool has_ended = false;
  while (lttng_session_daemon_alive() != 1) {
    if (!has_ended && process_->has_ended()) {
      has_ended = true;
      deadline = steady_clock::now() + (is_own ? seconds{0} : kOthersStartPatience);
    }
    if (steady_clock::now() > deadline) {
      throw RecordError("the session daemon of LTTng did not start: " + tail_of(log_file));
    }
    std::this_thread::sleep_for(kPollInterval);
  }
  // The daemon hears clients a moment before applications, and one that finds nobody runs untraced,
  // however long it was told to wait.
  const auto until = steady_clock::now() + kRegistrationPatience;
  while (!hears_applications(shared_run_directory()) && steady_clock::now() < until) {
    std::this_thread::sleep_for(kPollInterval);
  }
  if (!is_own) {
    yield_to_another();
  }
}

// Somebody else may have started a daemon meanwhile, and it is that one that answers. The program
// that was started here then ends by itself. Its group is not killed: who was quicker may have been
// started from it.
void SessionDaemon::yield_to_another() {
  const pid_t answers = answering_daemon(shared_run_directory());
  const auto deadline = steady_clock::now() + kOthersStartPatience;
  while (answers != process_->pid()) {
    if (process_->has_ended()) {
      process_->poll();
      process_.reset();
      return;
    }
    if (steady_clock::now() > deadline) {
      // A script that waits for the daemon that it started stands for the daemon.
      if (!descends_from(answers, process_->pid())) abandon_process();
      return;
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

void SessionDaemon::stop_if_unused() noexcept {
  if (!lock_.is_open() || !lock(lock_.get(), kDecision, F_WRLCK) ||
      !try_lock(lock_.get(), kUse, F_WRLCK)) {
    return;
  }
  const pid_t pid = started_daemon(lock_.get());
  if (pid <= 0) {
    return;
  }
  const bool answers = lttng_session_daemon_alive() == 1;
  if (answers && has_others_sessions()) {
    return;
  }
  // One of ours that does not answer is of no use to anybody.
  const bool is_ours = process_ && process_->pid() == pid;
  if (is_ours || (answers && is_session_daemon(pid))) {
    if (is_ours) {
      stop();
    } else {
      end_process(pid, kStopPatience);
    }
    static_cast<void>(!ftruncate(lock_.get(), 0));
  }
}

}  // namespace cie::record
