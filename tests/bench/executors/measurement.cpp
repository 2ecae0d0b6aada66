#include "measurement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <new>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bench {
namespace {

using namespace std::chrono_literals;

class SharedBoard {
 public:
  SharedBoard()
      : memory_(mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1,
                     0)) {
    if (memory_ == MAP_FAILED) throw std::bad_alloc{};
    board_ = new (memory_) Board;
  }
  SharedBoard(const SharedBoard&) = delete;
  SharedBoard& operator=(const SharedBoard&) = delete;
  ~SharedBoard() { munmap(memory_, sizeof(Board)); }
  Board& operator*() const noexcept { return *board_; }
  Board* operator->() const noexcept { return board_; }

 private:
  void* memory_;
  Board* board_ = nullptr;
};

pid_t start(const Workload& workload, Part part, const std::string& tag, Board& board) {
  const pid_t process = fork();
  if (process < 0) throw std::runtime_error{"cannot start a process"};
  if (process > 0) return process;
  int status = 0;
  try {
    run_part(workload, part, tag, board);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie-bench-executors: %s\n", error.what());
    status = 1;
  }
  _exit(status);
}

std::optional<std::uint64_t> pss_kib(const std::vector<pid_t>& processes) {
  std::uint64_t total = 0;
  for (const pid_t process : processes) {
    std::ifstream file{"/proc/" + std::to_string(process) + "/smaps_rollup"};
    std::string word;
    while (file >> word && word != "Pss:") {
    }
    std::uint64_t kib = 0;
    if (!(file >> kib)) return std::nullopt;
    total += kib;
  }
  return total;
}

// By nearest rank.
double quantile_us(const std::vector<std::uint32_t>& sorted, double p) {
  if (sorted.empty()) return 0;
  const auto rank = static_cast<std::size_t>(std::ceil(p * static_cast<double>(sorted.size())));
  return sorted[std::max<std::size_t>(rank, 1) - 1] / 1000.0;
}

void read_latencies(const Board& board, Measurement& result) {
  const std::size_t count = std::min<std::uint64_t>(result.messages, Board::kSamples);
  std::vector<std::uint32_t> latencies(count);
  std::copy_n(board.latency_ns.begin(), count, latencies.begin());
  if (latencies.empty()) return;
  std::ranges::sort(latencies);
  const auto sum = std::accumulate(latencies.begin(), latencies.end(), std::uint64_t{0});
  result.latency_mean_us = static_cast<double>(sum) / static_cast<double>(count) / 1000.0;
  result.latency_p50_us = quantile_us(latencies, 0.5);
  result.latency_p99_us = quantile_us(latencies, 0.99);
}

}  // namespace

std::optional<double> Measurement::per_message(std::optional<std::uint64_t> count) const {
  if (!count || messages == 0) return std::nullopt;
  return static_cast<double>(*count) / static_cast<double>(messages);
}

std::optional<Measurement> measure(const Workload& workload, double seconds) {
  const SharedBoard board;
  const std::string tag = "bench-" + std::to_string(getpid());
  std::vector<pid_t> processes;
  if (workload.placement == Placement::intra) {
    processes.push_back(start(workload, Part::both, tag, *board));
  } else {
    processes.push_back(start(workload, Part::subscriber, tag, *board));
    processes.push_back(start(workload, Part::publisher, tag, *board));
  }
  const auto bound = std::chrono::steady_clock::now() + 15s;
  while (board->ready < processes.size() && !board->is_ending &&
         std::chrono::steady_clock::now() < bound) {
    std::this_thread::sleep_for(10ms);
  }
  bool is_good = board->ready == processes.size();
  Measurement result{.seconds = seconds};
  if (is_good) {
    std::this_thread::sleep_for(1s);  // discovery has settled
    KernelCounter counter{processes};
    board->is_measuring = true;
    std::this_thread::sleep_for(std::chrono::duration<double>{seconds});
    board->is_measuring = false;
    result.counts = counter.stop();
    result.pss_kib = pss_kib(processes);
  }
  board->is_ending = true;
  for (const pid_t process : processes) {
    int status = 0;
    waitpid(process, &status, 0);
    is_good = is_good && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  if (!is_good) return std::nullopt;
  result.messages = board->messages.load();
  read_latencies(*board, result);
  return result;
}

void make_tracefs_visible() {
  if (access("/sys/kernel/tracing/events", F_OK) == 0 || unshare(CLONE_NEWNS) != 0) return;
  mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
  mount("none", "/sys/kernel/tracing", "tracefs", 0, nullptr);
}

}  // namespace bench
