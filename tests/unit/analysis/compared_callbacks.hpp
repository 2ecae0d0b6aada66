// Samples of one callback, and what becomes of them when they are compared.
#pragma once

#include <cie/analysis/comparison.hpp>

#include <cstdint>
#include <utility>

namespace cie::analysis {

// Values first, first + 1, …: ranks are known without looking.
inline Statistics ramp(std::int64_t first, std::int64_t count) {
  Statistics statistics;
  for (std::int64_t i = 0; i < count; ++i)
    statistics.add(Duration{first + i});
  return statistics;
}

inline CallbackSample sample(std::int64_t first, std::int64_t count) {
  CallbackSample result;
  result.logical_id = "/a";
  result.instances = static_cast<std::uint64_t>(count);
  result.never_ends = false;
  result.isolation = Isolation::isolated;
  result.is_isolation_claimed = true;
  result.response_time = OrderStatistics::of(ramp(first, count));
  return result;
}

// Two complete recordings of one length.
inline Comparison compared(CallbackSample before, CallbackSample after, double tolerance = 0.05) {
  const ComparedRecord record{.is_complete = true, .losses = {}, .length = Duration{1'000'000'000}};
  return compare(ComparedSide{.record = record, .callbacks = {std::move(before)}},
                 ComparedSide{.record = record, .callbacks = {std::move(after)}}, tolerance);
}

inline CallbackChange change(CallbackSample before, CallbackSample after) {
  return compared(std::move(before), std::move(after)).callbacks.at(0);
}

}  // namespace cie::analysis
