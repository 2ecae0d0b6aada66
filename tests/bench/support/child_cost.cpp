#include "child_cost.hpp"

#include <cerrno>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bench {
namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

// `start` returns a child's pid.
Cost cost_of(const std::function<pid_t()>& start) {
  const auto began = std::chrono::steady_clock::now();
  const auto process = start();
  int status = 0;
  rusage usage{};
  ::wait4(process, &status, 0, &usage);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - began;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw std::runtime_error("a program failed or is not installed");
  }
  return {.cpu_s = seconds(usage.ru_utime) + seconds(usage.ru_stime),
          .wall_s = elapsed.count(),
          .peak_mib = static_cast<double>(usage.ru_maxrss) / 1024};
}

}  // namespace

Cost measure(const std::function<void()>& child) {
  return cost_of([&child] {
    const auto process = ::fork();
    if (process < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (process != 0) return process;
    const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    ::dup2(null, STDOUT_FILENO);
    child();
    ::_exit(127);
  });
}

// Not by fork(): that a child copies pages of this process until it is another program would count
// as its time, 5 ms on some virtual machines.
Cost measure_program(std::vector<std::string> words) {
  return cost_of([&words] {
    std::vector<char*> arguments;
    for (auto& word : words)
      arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    pid_t process = 0;
    const auto error =
        ::posix_spawnp(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::system_error(error, std::generic_category(), words.front());
    return process;
  });
}

}  // namespace bench
