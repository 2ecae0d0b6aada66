#include "sandbox.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;

constexpr uid_t kNobody = 65534;

// Once per process: a mount namespace whose /run and /dev/shm are empty.
std::string hide_run() {
  static const std::string reason = [] {
    if (unshare(CLONE_NEWNS) != 0) {
      return std::string("root without the right to unshare mounts: ") + std::strerror(errno);
    }
    // /dev/shm has the flag by which daemons wake applications: one daemon's end would make the
    // applications of all others wait for 5 s.
    if (mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("none", "/run", "tmpfs", 0, "mode=755") != 0 ||
        mount("none", "/dev/shm", "tmpfs", 0, "mode=1777") != 0) {
      return std::string("root without the right to mount: ") + std::strerror(errno);
    }
    return std::string();
  }();
  return reason;
}

}  // namespace

void PrintTo(User user, std::ostream* out) {
  *out << (user == User::current ? "current user" : "ordinary user");
}

Running::~Running() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
}

void Running::signal(int number) const { kill(pid_, number); }

std::string Running::err() const { return read_file(output_.string() + ".err"); }

Finished Running::wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  return {.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          .out = read_file(output_.string() + ".out"),
          .err = read_file(output_.string() + ".err")};
}

Sandbox::Sandbox(User user) : user_(user) {
  std::string name = "/tmp/cie-live-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) {
    skip_reason_ = std::string("no temporary directory: ") + std::strerror(errno);
    return;
  }
  directory_ = name;
  const fs::path home = directory_ / "home";
  fs::create_directory(home);
  setenv("LTTNG_HOME", home.c_str(), 1);
  unsetenv("XDG_RUNTIME_DIR");
  if (geteuid() == 0) {
    skip_reason_ = hide_run();
    if (user == User::ordinary) {
      skip_reason_.clear();  // keeps away from root's daemon anyway
      for (const fs::path& path : {directory_, home}) {
        static_cast<void>(!chown(path.c_str(), kNobody, kNobody));
      }
      if (system("setpriv --reuid=65534 --regid=65534 --clear-groups test -x " CIE_RECORD) != 0) {
        skip_reason_ = "user 65534 cannot run " CIE_RECORD;
      }
    }
  } else if (user == User::ordinary) {
    skip_reason_ = "not root: this user is an ordinary one already";
  }
}

Sandbox::~Sandbox() {
  std::error_code ignored;
  fs::remove_all(directory_, ignored);
}

Running Sandbox::start(const std::vector<std::string>& command) {
  std::vector<std::string> words;
  if (user_ == User::ordinary) {
    words = {"setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"};
  }
  words.insert(words.end(), command.begin(), command.end());
  std::vector<char*> arguments;
  for (std::string& word : words) {
    arguments.push_back(word.data());
  }
  arguments.push_back(nullptr);

  const fs::path output = directory_ / ("output-" + std::to_string(++started_));
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(open((output.string() + ".out").c_str(), O_WRONLY | O_CREAT, 0644), STDOUT_FILENO);
    dup2(open((output.string() + ".err").c_str(), O_WRONLY | O_CREAT, 0644), STDERR_FILENO);
    static_cast<void>(!chdir(directory_.c_str()));
    execvp(arguments[0], arguments.data());
    _exit(127);
  }
  return Running(pid, output);
}

std::int64_t sleeps_of(pid_t process, const std::string& name) {
  constexpr std::size_t kNameRoom = 15;
  constexpr std::string_view kField = "\nvoluntary_ctxt_switches:";
  std::int64_t sum = 0;
  for (const auto& task :
       fs::directory_iterator(fs::path("/proc") / std::to_string(process) / "task")) {
    const bool is_meant =
        name.empty() || read_file(task.path() / "comm") == name.substr(0, kNameRoom) + '\n';
    const std::string status = read_file(task.path() / "status");
    const std::size_t at = status.find(kField);
    if (is_meant && at != std::string::npos) sum += std::stoll(status.substr(at + kField.size()));
  }
  return sum;
}

std::string read_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void sleep_10_ms() { std::this_thread::sleep_for(std::chrono::milliseconds(10)); }

}  // namespace cie::test
