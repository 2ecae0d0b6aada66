#include <cie/scheduling/started_threads.hpp>
#include <cie/scheduling/threads.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <fstream>
#include <string_view>
#include <thread>

#include <fmt/format.h>

namespace cie::scheduling {
namespace {

// Runs, or would if it had a CPU or its memory: a thread that has not come to its first instructions.
bool is_runnable(std::uint32_t tid) {
  std::ifstream file{fmt::format("/proc/self/task/{}/stat", tid)};
  std::string line;
  std::getline(file, line);
  const std::size_t name_end = line.rfind(") ");
  if (name_end == std::string::npos || name_end + 2 >= line.size()) return false;
  const char state = line[name_end + 2];
  return state == 'R' || state == 'D';
}

// A thread that is being started blocks what glibc keeps for itself, too, until it comes to run.
constexpr std::uint64_t kBeingStarted = std::uint64_t{1} << 31U;

// Bit n - 1 is signal n. None when the thread is gone.
std::uint64_t blocked_signals(std::uint32_t tid) {
  constexpr std::string_view kField = "SigBlk:";
  std::ifstream file{fmt::format("/proc/self/task/{}/status", tid)};
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(kField)) return std::stoull(line.substr(kField.size()), nullptr, 16);
  }
  return 0;
}

}  // namespace

StartedThreads::StartedThreads() : before_(thread_ids()) {
  sigset_t blocked;
  sigfillset(&blocked);
  sigdelset(&blocked, SIGXCPU);
  pthread_sigmask(SIG_BLOCK, &blocked, &former_);
}

StartedThreads::~StartedThreads() { pthread_sigmask(SIG_SETMASK, &former_, nullptr); }

std::vector<std::pair<std::uint32_t, std::string>> StartedThreads::named() const {
  using namespace std::chrono_literals;
  using std::chrono::steady_clock;
  const auto begin = steady_clock::now();
  const std::string own = thread_name(current_tid());
  const std::uint64_t mask = blocked_signals(current_tid());
  const auto may_name_itself = [&](std::uint32_t tid, const std::string& name) {
    const auto waited = steady_clock::now() - begin;
    return name == own && (waited < 50ms || (waited < 10s && is_runnable(tid)));
  };
  for (;;) {
    std::vector<std::pair<std::uint32_t, std::string>> found;
    bool is_complete = true;
    for (const std::uint32_t tid : thread_ids()) {
      if (before_.contains(tid)) continue;
      const std::uint64_t blocked = blocked_signals(tid);
      const std::string name = thread_name(tid);
      if (name.empty() || (blocked != mask && (blocked & kBeingStarted) == 0)) continue;
      if (may_name_itself(tid, name)) is_complete = false;
      if (blocked == mask) found.emplace_back(tid, name);
    }
    if (is_complete) return found;
    std::this_thread::sleep_for(1ms);
  }
}

}  // namespace cie::scheduling
