// A place where a test can record without meeting, or troubling, anybody else's session daemon.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include <sys/types.h>

namespace cie::test {

// Who runs the programs under test.
enum class User { current, ordinary };
void PrintTo(User user, std::ostream* out);  // GoogleTest's name for it

struct Finished {
  int status = -1;  // exit code, or 128 + signal
  std::string out;
  std::string err;
};

// A program that runs in the background. Killed by the destructor if it still does.
class Running {
 public:
  Running(pid_t pid, std::filesystem::path output) : pid_(pid), output_(std::move(output)) {}
  ~Running();
  Running(Running&& other) noexcept : pid_(other.pid_), output_(std::move(other.output_)) {
    other.pid_ = -1;
  }
  Running& operator=(Running&&) = delete;

  pid_t pid() const noexcept { return pid_; }
  void signal(int number) const;
  Finished wait();
  // What it has written to standard error so far.
  std::string err() const;

 private:
  pid_t pid_;
  std::filesystem::path output_;  // two files: .out and .err
};

// A temporary directory, an LTTNG_HOME in it and, for root, a /run of this process's own (a mount
// namespace), because root's session daemon has one fixed place.
class Sandbox {
 public:
  explicit Sandbox(User user);
  ~Sandbox();
  Sandbox(const Sandbox&) = delete;
  Sandbox& operator=(const Sandbox&) = delete;

  // Why nothing can be recorded here, as the suite wants a skip to be told; empty if it can.
  std::string skip_reason() const {
    return skip_reason_.empty() ? skip_reason_ : "not possible here: " + skip_reason_;
  }
  const std::filesystem::path& directory() const noexcept { return directory_; }

  Running start(const std::vector<std::string>& command);
  Finished run(const std::vector<std::string>& command) { return start(command).wait(); }

 private:
  User user_;
  std::filesystem::path directory_;
  std::string skip_reason_;
  int started_ = 0;
};

// Polls every 10 ms; false if `condition` does not come true in time.
template <typename Condition>
bool eventually(Condition condition, std::chrono::seconds patience = std::chrono::seconds(60));

// How often the threads of a process have gone to sleep; of those of a name, if one is given.
std::int64_t sleeps_of(pid_t process, const std::string& name = "");

std::string read_file(const std::filesystem::path& file);

void sleep_10_ms();

template <typename Condition>
bool eventually(Condition condition, std::chrono::seconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) {
      return false;
    }
    sleep_10_ms();
  }
  return true;
}

}  // namespace cie::test
