// What a measured process does around its executor, of whichever library that is.
#pragma once

#include "workload.hpp"

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <string>
#include <system_error>
#include <thread>

#include <sched.h>

namespace bench {

inline std::int64_t now_ns() {
  return std::chrono::nanoseconds{std::chrono::steady_clock::now().time_since_epoch()}.count();
}

// Every thread that comes after inherits it, those of DDS too.
inline void become_real_time(int priority) {
  if (priority == 0) return;
  const sched_param parameter{.sched_priority = priority};
  if (sched_setscheduler(0, SCHED_FIFO, &parameter) != 0) {
    throw std::system_error{errno, std::generic_category(),
                            "cannot become SCHED_FIFO (use --fifo 0 to measure without)"};
  }
}

inline std::string topic(unsigned index) { return "/bench/data" + std::to_string(index); }

// What a subscription's callback does with a message that was stamped with now_ns().
inline void count(Board& board, std::int64_t stamp) {
  if (!board.is_measuring.load(std::memory_order_acquire)) return;
  const auto latency = static_cast<std::uint32_t>(now_ns() - stamp);
  const std::uint64_t index = board.messages.fetch_add(1, std::memory_order_relaxed);
  board.latency_ns[index % Board::kSamples] = latency;
}

// Calls spin(); beside it waits for the connections, then for the executor to serve, tells the board,
// and calls `end` when the board says so.
template <typename IsConnected, typename WaitUntilServing, typename Spin, typename End>
void spin_until_ended(Board& board, IsConnected is_connected, WaitUntilServing wait_until_serving,
                      Spin spin, End end) {
  using std::chrono::milliseconds;
  std::thread watcher{[&] {
    while (!is_connected() && !board.is_ending)
      std::this_thread::sleep_for(milliseconds{5});
    wait_until_serving();
    ++board.ready;
    // Slowly: what this thread does is counted too.
    while (!board.is_ending)
      std::this_thread::sleep_for(milliseconds{200});
    end();
  }};
  try {
    spin();
  } catch (...) {
    board.is_ending = true;
    watcher.join();
    throw;
  }
  watcher.join();
}

}  // namespace bench
