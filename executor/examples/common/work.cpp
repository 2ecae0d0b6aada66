#include "work.hpp"

#include <atomic>
#include <ctime>

namespace example {
namespace {

constexpr double kStepsPerUnit = 400;
double load_factor = 1;

std::atomic<std::uint64_t> sink;  // keeps the steps from being optimised away

std::chrono::nanoseconds cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds{time.tv_sec} + std::chrono::nanoseconds{time.tv_nsec};
}

void take_steps(std::uint64_t steps) {
  std::uint64_t value = 88172645463325252U;
  for (std::uint64_t i = 0; i < steps; ++i) {
    value ^= value << 13U;
    value ^= value >> 7U;
    value ^= value << 17U;
  }
  sink.store(value, std::memory_order_relaxed);
}

}  // namespace

void Work::set_load(double factor) { load_factor = factor; }

void Work::operator()() const {
  take_steps(static_cast<std::uint64_t>(amount_ * kStepsPerUnit * load_factor));
}

void use_cpu(std::chrono::nanoseconds time) {
  constexpr std::uint64_t kStepsBetweenLooks = 10'000;
  const auto end = cpu_time() + time;
  while (cpu_time() < end)
    take_steps(kStepsBetweenLooks);
}

}  // namespace example
