#include "flight_saver.hpp"

#include "base/directory.hpp"
#include "command_line.hpp"
#include "commands.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::cli {
namespace {

// Where a flight recorder says that it is there.
constexpr const char* kRecorderFile = "recorder.pid";

[[noreturn]] void fail(int error, const char* what) {
  throw std::system_error(error, std::generic_category(), what);
}

// Starts a program whose output goes to `output`, with no signal blocked or ignored.
pid_t spawn(const std::string& program, const Arguments& arguments, int output) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const auto& argument : arguments)
    argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
  sigset_t none{};
  sigset_t all{};
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&files, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&files, output, STDERR_FILENO);
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  const int error = ::posix_spawn(&pid, program.c_str(), &files, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) fail(error, "cannot start cie-record");
  return pid;
}

std::string read_all(int descriptor) {
  std::string text;
  std::array<char, 1024> part{};
  for (auto size = ::read(descriptor, part.data(), part.size()); size > 0;
       size = ::read(descriptor, part.data(), part.size())) {
    text.append(part.data(), static_cast<std::size_t>(size));
  }
  while (text.ends_with('\n'))
    text.pop_back();
  return text;
}

}  // namespace

FlightSaver::FlightSaver(std::string directory)
    : directory_(std::move(directory)), program_(program_path("cie-record")) {
  check();
}

// What cie-record checks each time, before there is anything to save.
void FlightSaver::check() const {
  try {
    const Directory directory = Directory::open(directory_);
    if (const auto why = directory.distrust(); !why.empty())
      throw UsageError("\"" + directory_ + "\" " + why + ": no snapshots of yours are kept there");
    if (directory.has(kRecorderFile)) return;
  } catch (const UntrustedLink& link) {
    throw UsageError(link.what());
  } catch (const std::system_error&) {
    // It is not there.
  }
  throw UsageError("nobody keeps snapshots in \"" + directory_ +
                   "\": start cie record --snapshot SECONDS --attach -o DIR first");
}

FlightSaver::~FlightSaver() {
  if (is_busy()) ::kill(pid_, SIGTERM);
  wait();
}

void FlightSaver::ask(const std::string& reason) {
  std::array<int, 2> output{};
  if (::pipe2(output.data(), O_CLOEXEC) != 0) fail(errno, "cannot create a pipe");
  output_ = output[0];
  reason_ = reason;
  try {
    pid_ = spawn(program_, {"--save", directory_, "--reason", reason}, output[1]);
  } catch (...) {
    ::close(output[1]);
    ::close(std::exchange(output_, -1));
    throw;
  }
  ::close(output[1]);
}

std::optional<std::string> FlightSaver::reap(int flags) {
  if (!is_busy()) return std::nullopt;
  int status = 0;
  pid_t ended = 0;
  do {
    ended = ::waitpid(pid_, &status, flags);
  } while (ended < 0 && errno == EINTR);
  if (ended == 0) return std::nullopt;
  pid_ = -1;
  const auto said = read_all(output_);  // a line or two: they fit into the pipe
  ::close(std::exchange(output_, -1));
  const bool is_saved = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return is_saved ? "saved " + said + " (" + reason_ + ')'
                  : "nothing was saved (" + reason_ + "): " + said;
}

std::optional<std::string> FlightSaver::poll() { return reap(WNOHANG); }

std::optional<std::string> FlightSaver::wait() { return reap(0); }

}  // namespace cie::cli
