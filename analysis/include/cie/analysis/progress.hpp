// How far a long piece of work is.
#pragma once

#include <atomic>
#include <cstdint>

namespace cie::analysis {

// Counted by the thread that works, looked at by another that shows it. What is counted (bytes of
// the traces, instances) is told where one is taken.
struct Progress {
  std::atomic<std::uint64_t> total{0};  // 0: not known
  std::atomic<std::uint64_t> done{0};

  // For the one thread that counts.
  void add(std::uint64_t amount) noexcept {
    done.store(done.load(std::memory_order_relaxed) + amount, std::memory_order_relaxed);
  }
};

}  // namespace cie::analysis
