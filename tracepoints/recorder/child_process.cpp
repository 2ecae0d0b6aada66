#include "child_process.hpp"

#include "error.hpp"
#include "file_descriptor.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>

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
  write_end.reset();
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
      status_ = WIFSIGNALED(status)
                    ? ExitStatus{.code = std::nullopt, .signal = WTERMSIG(status)}
                    : ExitStatus{.code = WEXITSTATUS(status), .signal = std::nullopt};
    }
  }
  return status_;
}

void ChildProcess::kill(int signal) noexcept {
  if (!status_) {
    ::kill(pid_, signal);
  }
}

}  // namespace cie::record
