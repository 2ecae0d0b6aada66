// How long an instance took: what is known of it, and what is certain.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/time.hpp>

#include <algorithm>
#include <optional>

namespace cie::analysis {

// From its release to its end, and to its start; of what kind the release is, release_source says:
// exact, or a bound. Empty where there is none, and the former while the instance is open.
inline std::optional<Duration> response_time(const Instance& instance) noexcept {
  if (!instance.end || !instance.release) return std::nullopt;
  return *instance.end - *instance.release;
}
inline std::optional<Duration> start_latency(const Instance& instance) noexcept {
  if (!instance.release) return std::nullopt;
  return instance.start - *instance.release;
}

// What is certain of an instance's response time: all of it where its release is known exactly, a
// lower bound elsewhere (of a calculated one, as if the timer had been reset unnoticed). Empty while it is open.
std::optional<Duration> least_response_time(const Instance& instance) noexcept;
// The same of an instance that ended and has a release of some kind.
inline Duration least_response_time(ReleaseSource source, Timestamp release, Timestamp start,
                                    Timestamp end) noexcept {
  switch (source) {
    case ReleaseSource::exact:
    case ReleaseSource::wakeup:
      return end - release;
    case ReleaseSource::timer_grid:
      return end - std::min(release + kMostTimerError, start);
    default:  // a bound of the other side: the message was written before it arrived
      return end - start;
  }
}
// The response time where its release is known, calculated ones included; else that bound.
std::optional<Duration> response_time_or_bound(const Instance& instance) noexcept;

}  // namespace cie::analysis
