// The paper's experiment: N timers publish, N subscriptions receive, under one executor.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace bench {

enum class Placement : std::uint8_t { intra, inter };
enum class Phases : std::uint8_t { aligned, staggered };
// publish() of a reference, of a message handed over, with Cyclone's own serialisation, and through
// shared memory (needs a running iox-roudi).
enum class Passing : std::uint8_t { copy, pointer, serialized, shared };

struct Workload {
  std::string executor = "isolated";  // one of executor_names()
  Placement placement = Placement::intra;
  Phases phases = Phases::staggered;
  unsigned pairs = 8;  // timers, and subscriptions
  std::chrono::milliseconds period{10};
  unsigned threads = 0;  // of multi
  unsigned payload = 32;
  Passing passing = Passing::copy;
  bool best_effort = false;
  int fifo_priority = 50;  // 0: as started
};

// Of which this program has the workload.
std::vector<std::string> executor_names();

// What the measured processes tell the measuring one, in memory that they share.
struct Board {
  static constexpr std::size_t kSamples = 1U << 18U;
  std::atomic<bool> is_measuring{false};
  std::atomic<bool> is_ending{false};
  std::atomic<std::uint32_t> ready{0};               // processes that serve and are connected
  std::atomic<std::uint64_t> messages{0};            // received while measuring
  std::array<std::uint32_t, kSamples> latency_ns{};  // publish to callback, while measuring
};

// The body of a measured process: the publishing node, the subscribing one, or both. Returns when
// the board says so.
enum class Part : std::uint8_t { publisher, subscriber, both };
void run_part(const Workload& workload, Part part, const std::string& tag, Board& board);

}  // namespace bench
