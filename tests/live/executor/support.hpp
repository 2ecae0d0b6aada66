// What the live tests of the executor share: a private place on the loopback interface.
#pragma once

#include <cie/executor/executor.hpp>
#include <cie/executor/node.hpp>

#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <cie_messages.hpp>
#include <spawn.h>
#include <sys/types.h>
#include <unistd.h>

namespace cie::test {

using namespace std::chrono_literals;

// Several test processes run at once: the domain spreads them over ports, the tag keeps those that
// share one apart.
inline Context::Options private_options() {
  constexpr std::uint32_t kDomains = 200;
  const auto pid = static_cast<std::uint32_t>(getpid());
  return {.domain = 20 + pid % kDomains, .loopback = true, .tag = "test-" + std::to_string(pid)};
}

// Waits for `is_true` with a generous bound: a failure means "never", not "late".
inline bool eventually(const std::function<bool()>& is_true, std::chrono::seconds bound = 50s) {
  const auto end = std::chrono::steady_clock::now() + bound;
  while (!is_true()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(1ms);
  }
  return true;
}

struct NamedThread {
  std::string name;
  pid_t tid = 0;
};

// The threads that this process has now, as the kernel names them.
inline std::vector<NamedThread> threads_now() {
  std::vector<NamedThread> threads;
  for (const auto& task : std::filesystem::directory_iterator{"/proc/self/task"}) {
    NamedThread& thread = threads.emplace_back();
    thread.tid = std::stoi(task.path().filename());
    std::getline(std::ifstream{task.path() / "comm"}, thread.name);
  }
  return threads;
}

inline std::size_t thread_count() { return threads_now().size(); }

// What `measure` says of the process once it says the same for a while: threads of DDS, the tracer and
// the executor come and go a little later than calls return.
template <typename Measure>
auto settled(Measure measure) {
  auto last = measure();
  int times = 0;
  eventually(
      [&] {
        std::this_thread::sleep_for(10ms);
        auto now = measure();
        times = now == last ? times + 1 : 0;
        last = std::move(now);
        return times == 10;
      },
      5s);
  return last;
}

// spin() on a thread of its own; what it throws comes out of wait(). Cancels when it goes.
class Spinning {
 public:
  explicit Spinning(Executor& executor)
      : executor_(executor),
        done_(std::async(std::launch::async, [&executor] { executor.spin(); })) {
    eventually([this] { return executor_.is_spinning() || is_done(); });
  }
  Spinning(const Spinning&) = delete;
  Spinning& operator=(const Spinning&) = delete;
  ~Spinning() {
    if (!done_.valid()) return;
    executor_.cancel();
    done_.wait();
  }
  bool is_done() const { return done_.wait_for(0s) == std::future_status::ready; }
  void wait() { done_.get(); }
  void cancel_and_wait() {
    executor_.cancel();
    done_.get();
  }

 private:
  Executor& executor_;
  std::future<void> done_;
};

// This same program as another process of the same place, running one test of its own, which is
// named DISABLED_ because it is none by itself. 0 if it cannot be started.
inline pid_t start_child(const Context::Options& options, const std::string& test) {
  setenv("CIE_DOMAIN_ID", std::to_string(options.domain).c_str(), 1);
  setenv("CIE_LOOPBACK", "1", 1);
  setenv("CIE_DISCOVERY_TAG", options.tag.c_str(), 1);
  setenv("CIE_SHARED_MEMORY", options.shared_memory ? "1" : "0", 1);
  std::vector<std::string> arguments{"child", "--gtest_filter=" + test,
                                     "--gtest_also_run_disabled_tests"};
  std::vector<char*> raw;
  for (std::string& argument : arguments)
    raw.push_back(argument.data());
  raw.push_back(nullptr);
  pid_t child = 0;
  return posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, raw.data(), environ) == 0 ? child
                                                                                           : 0;
}

}  // namespace cie::test
