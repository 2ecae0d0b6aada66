#include "system/child_process.hpp"

#include "base/file_descriptor.hpp"
#include "base/text.hpp"
#include "system/error.hpp"
#include "system/processes.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::record {
namespace {

// What the new process does until it is the other program: async-signal-safe calls only, except for
// setenv, which is safe because this program has one thread when it forks.
[[noreturn]] void execute(char* const* arguments, const ChildOptions& options, pid_t parent,
                          int error_pipe) {
  const auto give_up = [error_pipe] {
    const int error = errno;
    static_cast<void>(!write(error_pipe, &error, sizeof error));
    _exit(127);
  };
  if (options.dies_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() != parent) {
      _exit(127);
    }
  }
  if (options.is_detached) {
    setsid();
  }
  if (options.outlives_file_limit) {
    signal(SIGXFSZ, SIG_IGN);
  }
  if (!options.log_file.empty()) {
    const int log = open(options.log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
    if (log < 0) {
      give_up();
    }
    dup2(log, STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    const int null = open("/dev/null", O_RDONLY);
    dup2(null, STDIN_FILENO);
  }
  for (const auto& [name, value] : options.environment) {
    setenv(name.c_str(), value.c_str(), 1);
  }
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  execvp(arguments[0], arguments);
  give_up();
  _exit(127);
}

ExitStatus status_of(int status) {
  return WIFSIGNALED(status) ? ExitStatus{.code = std::nullopt, .signal = WTERMSIG(status)}
                             : ExitStatus{.code = WEXITSTATUS(status), .signal = std::nullopt};
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& command, const ChildOptions& options) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command) {
    arguments.push_back(const_cast<char*>(argument.c_str()));  // execvp does not write to them
  }
  arguments.push_back(nullptr);

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    throw system_error("cannot create a pipe", errno);
  }
  FileDescriptor read_end(ends[0]);
  FileDescriptor write_end(ends[1]);
  const pid_t parent = getpid();
  pid_ = fork();
  if (pid_ < 0) {
    throw system_error("cannot create a process for " + in_quotes(command.front()), errno);
  }
  if (pid_ == 0) {
    execute(arguments.data(), options, parent, write_end.get());
  }
  write_end.close();
  int error = 0;  // arrives only if the program could not be executed
  if (read(read_end.get(), &error, sizeof error) == sizeof error) {
    waitpid(pid_, nullptr, 0);
    throw system_error("cannot run " + in_quotes(command.front()), error);
  }
}

std::optional<ExitStatus> ChildProcess::poll() {
  if (!status_) {
    int status = 0;
    if (waitpid(pid_, &status, WNOHANG) == pid_) {
      status_ = status_of(status);
    }
  }
  return status_;
}

bool ChildProcess::has_ended() const noexcept {
  siginfo_t info{};
  const int options = WEXITED | WNOHANG | WNOWAIT;
  return status_ || waitid(P_PID, static_cast<id_t>(pid_), &info, options) != 0 ||
         info.si_pid == pid_;
}

void ChildProcess::kill(int signal) noexcept {
  if (!status_) {
    ::kill(pid_, signal);
  }
}

void ChildProcess::end_group(std::chrono::milliseconds patience) noexcept {
  using std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kPoll{10};
  constexpr std::chrono::seconds kLast{5};  // a killed process ends, unless it waits for a disk
  if (status_) return;  // its number, which is the group's, may be another one's by now
  // Orphans of the group become this process's children, which can be waited for.
  prctl(PR_SET_CHILD_SUBREAPER, 1);
  const auto wait_until = [kPoll](steady_clock::time_point deadline, const auto& is_over) {
    while (!is_over() && steady_clock::now() < deadline)
      std::this_thread::sleep_for(kPoll);
  };
  // Not reaped yet: so nobody else gets its number.
  wait_until(steady_clock::now() + patience, [this] { return !is_group_running(pid_); });
  ::kill(-pid_, SIGKILL);
  wait_until(steady_clock::now() + kLast, [this] {
    int status = 0;
    pid_t ended = 0;
    while ((ended = waitpid(-pid_, &status, WNOHANG)) > 0) {
      if (ended == pid_) status_ = status_of(status);
    }
    return ended < 0;
  });
  prctl(PR_SET_CHILD_SUBREAPER, 0);
}

}  // namespace cie::record
