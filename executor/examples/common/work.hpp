// CPU load that can be scaled.
#pragma once

#include <chrono>
#include <cstdint>

namespace example {

// About `amount` microseconds of a slow core's time, times the factor of --load. A fixed number of
// steps, not a span of time: a preempted callback does the same work, later.
class Work {
 public:
  explicit Work(std::uint32_t amount) : amount_(amount) {}
  static void set_load(double factor);
  void operator()() const;

 private:
  std::uint32_t amount_;
};

// Takes that much of the calling thread's CPU time, on however fast a machine.
void use_cpu(std::chrono::nanoseconds time);

}  // namespace example
