#include "work.hpp"

#include <atomic>

namespace example {
namespace {

constexpr double kStepsPerUnit = 400;
double load_factor = 1;

std::atomic<std::uint64_t> sink;  // keeps the steps from being optimised away

}  // namespace

void Work::set_load(double factor) { load_factor = factor; }

void Work::operator()() const {
  const auto steps = static_cast<std::uint64_t>(amount_ * kStepsPerUnit * load_factor);
  std::uint64_t value = 88172645463325252U;
  for (std::uint64_t i = 0; i < steps; ++i) {
    value ^= value << 13U;
    value ^= value >> 7U;
    value ^= value << 17U;
  }
  sink.store(value, std::memory_order_relaxed);
}

}  // namespace example
