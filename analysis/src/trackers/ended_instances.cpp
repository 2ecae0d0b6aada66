#include "ended_instances.hpp"

#include <cstddef>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxWaiting = 100'000;

}  // namespace

void EndedInstances::measure_first() {
  measure(std::move(waiting_.front()));
  waiting_.pop_front();
}

void EndedInstances::measure_settled(const EventHead& head) {
  const auto here = registry_.host_of(head);
  while (!waiting_.empty() &&
         (is_settled(*waiting_.front(), head.time, here) || waiting_.size() > kMaxWaiting)) {
    measure_first();
  }
}

void EndedInstances::measure_all() {
  while (!waiting_.empty())
    measure_first();
}

}  // namespace cie::analysis
