#include <cie/analysis/guard.hpp>

#include "guard_state.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <new>
#include <optional>
#include <string>
#include <system_error>

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::analysis {
namespace {

// Shared by parent and child; ticks stand still while the child is stuck.
struct Shared {
  std::atomic<std::uint64_t> ticks;
  std::atomic<bool> is_reading;
};
Shared* shared = nullptr;

constexpr std::int64_t kNanosecond = 1'000'000'000;
constexpr std::int64_t kCpuLimit = 10 * kNanosecond;
constexpr std::int64_t kRealLimit = 60 * kNanosecond;

std::int64_t now(clockid_t clock) noexcept {
  timespec time{};
  if (clock_gettime(clock, &time) != 0) return 0;
  return time.tv_sec * kNanosecond + time.tv_nsec;
}

void limit_memory() noexcept {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  const auto pages = sysconf(_SC_PHYS_PAGES);
  const auto page = sysconf(_SC_PAGESIZE);
  if (pages <= 0 || page <= 0) return;
  const auto bytes = static_cast<rlim_t>(pages) / 2 * static_cast<rlim_t>(page);
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
  if (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur > bytes) {
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_DATA, &limit);
  }
#endif
}

// Watches the child's signs of life; true if it had to be ended.
class Watch {
 public:
  explicit Watch(pid_t child) : has_clock_(clock_getcpuclockid(child, &clock_) == 0) { restart(); }

  bool is_stuck() {
    const auto ticks = shared->ticks.load(std::memory_order_relaxed);
    if (ticks != ticks_ || !shared->is_reading.load(std::memory_order_relaxed)) {
      restart();
      return false;
    }
    const bool burns = has_clock_ && now(clock_) - cpu_ > kCpuLimit;
    return burns || now(CLOCK_MONOTONIC) - real_ > kRealLimit;
  }

 private:
  void restart() {
    ticks_ = shared->ticks.load(std::memory_order_relaxed);
    cpu_ = has_clock_ ? now(clock_) : 0;
    real_ = now(CLOCK_MONOTONIC);
  }
  clockid_t clock_{};
  bool has_clock_;
  std::uint64_t ticks_ = 0;
  std::int64_t cpu_ = 0;
  std::int64_t real_ = 0;
};

// The child, for the handler; 0: none.
std::atomic<pid_t> guarded_child = 0;
static_assert(std::atomic<pid_t>::is_always_lock_free);

extern "C" void forward_signal(int number) {
  const auto child = guarded_child.load();
  if (child > 0) kill(child, number);
}

// Signals that would end the caller go to the child, which cleans up; the caller then ends by the
// same signal. What the caller ignores stays ignored.
class ForwardedSignals {
 public:
  explicit ForwardedSignals(pid_t child) {
    guarded_child = child;
    struct sigaction forward {};
    forward.sa_handler = forward_signal;
    for (std::size_t i = 0; i < kSignals.size(); ++i) {
      sigaction(kSignals[i], nullptr, &before_[i]);
      if (before_[i].sa_handler != SIG_IGN) sigaction(kSignals[i], &forward, nullptr);
    }
  }
  ~ForwardedSignals() {
    for (std::size_t i = 0; i < kSignals.size(); ++i)
      sigaction(kSignals[i], &before_[i], nullptr);
    guarded_child = 0;
  }
  ForwardedSignals(const ForwardedSignals&) = delete;
  ForwardedSignals& operator=(const ForwardedSignals&) = delete;

 private:
  static constexpr std::array<int, 3> kSignals{SIGINT, SIGTERM, SIGHUP};
  std::array<struct sigaction, 3> before_{};
};

pid_t wait_for(pid_t child, int& status, int flags) {
  pid_t done = 0;
  do {
    done = waitpid(child, &status, flags);
  } while (done < 0 && errno == EINTR);
  return done;
}

}  // namespace

void guard_tick() noexcept {
  if (shared == nullptr) return;
  shared->ticks.store(shared->ticks.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  shared->is_reading.store(true, std::memory_order_relaxed);
}

void guard_reading_ended() noexcept {
  if (shared != nullptr) shared->is_reading.store(false, std::memory_order_relaxed);
}

int run_guarded(const std::function<int()>& command) {
  void* memory =
      mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
  shared = new (memory) Shared{.ticks = 0, .is_reading = false};
  const auto parent = getpid();
  const auto child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(4);
    limit_memory();
    std::exit(command());
  }
  std::optional<ForwardedSignals> forwarded(child);
  Watch watch(child);
  int status = 0;
  bool was_ended = false;
  // Short commands end within the first pauses; long ones are looked at fifty times a second.
  for (long pause_ns = 200'000;; pause_ns = std::min(2 * pause_ns, 20'000'000L)) {
    if (wait_for(child, status, WNOHANG) == child) break;
    if (watch.is_stuck()) {
      kill(child, SIGKILL);
      wait_for(child, status, 0);
      was_ended = true;
      break;
    }
    const timespec pause{.tv_sec = 0, .tv_nsec = pause_ns};
    nanosleep(&pause, nullptr);
  }
  forwarded.reset();
  munmap(memory, sizeof(Shared));
  shared = nullptr;
  if (was_ended) {
    throw GuardedFailure(
        "reading the trace made no progress and was ended: a file of it is damaged in a way that "
        "libbabeltrace2 loops on; compare the files with the recording's manifest");
  }
  if (WIFSIGNALED(status)) {
    const auto signal = WTERMSIG(status);
    if (signal == SIGPIPE || signal == SIGINT || signal == SIGTERM || signal == SIGHUP) {
      std::signal(signal, SIG_DFL);
      std::raise(signal);
    }
    throw GuardedFailure(std::string("reading the trace was ended by a signal (") +
                         strsignal(signal) +
                         "): a file of it is damaged; compare the files with the recording's "
                         "manifest");
  }
  return WEXITSTATUS(status);
}

}  // namespace cie::analysis
