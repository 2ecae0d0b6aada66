// cie-bench-executors: what one message costs under each executor.
#include <cie/executor/executor.hpp>

#include "kernel_counts.hpp"
#include "workload.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bench {
namespace {

using namespace std::chrono_literals;

struct Settings {
  std::vector<std::string> executors{cie::kExecutorNames.begin(), cie::kExecutorNames.end()};
  std::vector<std::string> placements{"intra", "inter"};
  std::vector<std::string> phases{"staggered", "aligned"};
  std::vector<unsigned> pairs{1, 8, 24};
  std::vector<unsigned> payloads{32};
  std::vector<std::string> passings{"copy"};
  Workload common;
  double seconds = 3;
  int period_ms = 10;
};

Board* shared_board() {
  void* const memory =
      mmap(nullptr, sizeof(Board), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc{};
  return new (memory) Board;
}

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

double quantile_us(std::vector<std::uint32_t>& sorted, double p) {
  if (sorted.empty()) return 0;
  const auto rank = static_cast<std::size_t>(p * static_cast<double>(sorted.size() - 1));
  return sorted[rank] / 1000.0;
}

void print_cell(const std::optional<std::uint64_t>& count, double messages) {
  if (count && messages > 0) {
    std::printf(" %9.2f", static_cast<double>(*count) / messages);
  } else {
    std::printf(" %9s", "-");
  }
}

const char* name_of(Passing passing) {
  switch (passing) {
    case Passing::copy:
      return "copy";
    case Passing::pointer:
      return "pointer";
    case Passing::shared:
      return "shared";
    default:
      return "serialized";
  }
}

// One row of the table; false when it could not be measured.
bool measure(const Workload& workload, double seconds) {
  Board* const board = shared_board();
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
  KernelCounts counts;
  if (is_good) {
    std::this_thread::sleep_for(1s);  // discovery has settled
    KernelCounter counter{processes};
    board->is_measuring = true;
    std::this_thread::sleep_for(std::chrono::duration<double>{seconds});
    board->is_measuring = false;
    counts = counter.stop();
  }
  board->is_ending = true;
  for (const pid_t process : processes) {
    int status = 0;
    waitpid(process, &status, 0);
    is_good = is_good && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  if (is_good) {
    const auto messages = static_cast<double>(board->messages.load());
    std::vector<std::uint32_t> latencies(
        board->latency_ns.begin(),
        board->latency_ns.begin() + static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(
                                        board->messages.load(), Board::kSamples)));
    std::ranges::sort(latencies);
    std::printf("%-16s %-6s %-10s %8u %-10s %5u %9.0f", workload.executor.c_str(),
                workload.placement == Placement::intra ? "intra" : "inter",
                workload.phases == Phases::aligned ? "aligned" : "staggered", workload.payload,
                name_of(workload.passing), workload.pairs, messages);
    print_cell(counts.system_calls, messages);
    print_cell(counts.context_switches, messages);
    std::printf(" %9.2f %9.1f %9.1f\n",
                messages > 0 ? static_cast<double>(counts.cpu_ns) / messages / 1000.0 : 0,
                quantile_us(latencies, 0.5), quantile_us(latencies, 0.99));
    std::fflush(stdout);
  }
  munmap(board, sizeof(Board));
  return is_good;
}

// The number of the system call event stands in tracefs. Where that is not mounted, root may mount
// it for this process alone.
void make_tracefs_visible() {
  if (access("/sys/kernel/tracing/events", F_OK) == 0 || unshare(CLONE_NEWNS) != 0) return;
  mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr);
  mount("none", "/sys/kernel/tracing", "tracefs", 0, nullptr);
}

// The table's rows: every combination, the last setting changing fastest.
std::vector<Workload> rows(const Settings& settings) {
  std::vector<Workload> rows{settings.common};
  rows.front().period = std::chrono::milliseconds{settings.period_ms};
  const auto multiply = [&rows](const auto& values, auto set) {
    std::vector<Workload> product;
    for (const Workload& row : rows) {
      for (const auto& value : values) {
        product.push_back(row);
        set(product.back(), value);
      }
    }
    rows = std::move(product);
  };
  multiply(settings.placements, [](Workload& row, const std::string& value) {
    row.placement = value == "intra" ? Placement::intra : Placement::inter;
  });
  multiply(settings.phases, [](Workload& row, const std::string& value) {
    row.phases = value == "aligned" ? Phases::aligned : Phases::staggered;
  });
  multiply(settings.executors,
           [](Workload& row, const std::string& value) { row.executor = value; });
  multiply(settings.payloads, [](Workload& row, unsigned value) { row.payload = value; });
  multiply(settings.passings, [](Workload& row, const std::string& value) {
    row.passing = value == "copy"      ? Passing::copy
                  : value == "pointer" ? Passing::pointer
                  : value == "shared"  ? Passing::shared
                                       : Passing::serialized;
  });
  multiply(settings.pairs, [](Workload& row, unsigned value) { row.pairs = value; });
  return rows;
}

int run(const Settings& settings) {
  make_tracefs_visible();
  std::printf("period %d ms, %s, %s, %.1f s per row\n\n", settings.period_ms,
              settings.common.best_effort ? "best effort" : "reliable",
              settings.common.fifo_priority > 0
                  ? ("SCHED_FIFO " + std::to_string(settings.common.fifo_priority)).c_str()
                  : "SCHED_OTHER",
              settings.seconds);
  std::printf("%-16s %-6s %-10s %8s %-10s %5s %9s %9s %9s %9s %9s %9s\n", "executor", "path",
              "phases", "bytes", "passing", "N", "messages", "calls/msg", "ctxsw/msg", "cpu us",
              "p50 us", "p99 us");
  bool is_good = true;
  for (const Workload& workload : rows(settings)) {
    is_good = measure(workload, settings.seconds) && is_good;
  }
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  CLI::App app{
      "N timers publish, N subscriptions receive. Per message: system calls and context switches\n"
      "of all threads of all processes (those of DDS too), CPU time, and the time from publish to\n"
      "callback. System calls need root and tracefs."};
  app.name("cie-bench-executors");
  app.add_option("--executors", settings.executors)
      ->check(CLI::IsMember(
          std::vector<std::string>(cie::kExecutorNames.begin(), cie::kExecutorNames.end())))
      ->delimiter(',');
  app.add_option("--paths", settings.placements, "intra: one process, inter: two")
      ->check(CLI::IsMember({"intra", "inter"}))
      ->delimiter(',');
  app.add_option("--phases", settings.phases, "Of the timers")
      ->check(CLI::IsMember({"aligned", "staggered"}))
      ->delimiter(',');
  app.add_option("-n,--pairs", settings.pairs, "Timers, and subscriptions")
      ->check(CLI::Range(1U, 64U))
      ->delimiter(',');
  app.add_option("--seconds", settings.seconds, "Per row")->check(CLI::Range(0.1, 3600.0));
  app.add_option("--period", settings.period_ms, "Milliseconds")->check(CLI::Range(1, 10000));
  app.add_option("--payload", settings.payloads, "Bytes")
      ->check(CLI::Range(0U, 10000000U))
      ->delimiter(',');
  app.add_option(
         "--passing", settings.passings,
         "copy: publish a reference; pointer: hand the message over; serialized: by Cyclone "
         "DDS alone; shared: through shared memory, with iox-roudi running")
      ->check(CLI::IsMember({"copy", "pointer", "serialized", "shared"}))
      ->delimiter(',');
  app.add_option("--threads", settings.common.threads, "Of multi; 0: one for each CPU");
  app.add_option("--fifo", settings.common.fifo_priority, "SCHED_FIFO priority; 0: SCHED_OTHER")
      ->check(CLI::Range(0, 99));
  app.add_flag("--best-effort", settings.common.best_effort);
  CLI11_PARSE(app, argc, argv);
  try {
    return bench::run(settings);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie-bench-executors: %s\n", error.what());
    return 2;
  }
}
