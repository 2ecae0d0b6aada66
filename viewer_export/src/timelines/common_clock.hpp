// Times of several hosts on one clock, so that what passes between them has its order and length.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>
#include <cie/analysis/time.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace cie::viewer_export {

// CLOCK_MONOTONIC of the host that has been up the longest: no host's times are below zero on it.
// Of one host, or where nothing relates their clocks, each host's own.
class CommonClock {
 public:
  CommonClock() = default;
  explicit CommonClock(const analysis::Report& report);

  // A time of the host's CLOCK_MONOTONIC.
  std::int64_t of(analysis::HostIndex host, std::int64_t time) const noexcept {
    return (analysis::Timestamp{time} + shift_of(host)).ns;
  }
  // The other way round.
  std::int64_t own(analysis::HostIndex host, std::int64_t common) const noexcept {
    return (analysis::Timestamp{common} - shift_of(host)).ns;
  }
  // A time of the report's TraceSummary.
  std::int64_t of_summary(analysis::Timestamp time) const noexcept { return (time + lift_).ns; }
  analysis::Duration shift_of(analysis::HostIndex host) const noexcept {
    return at(host) < shifts_.size() ? shifts_[at(host)] : analysis::Duration{};
  }
  bool is_shifted() const noexcept { return !shifts_.empty(); }
  // CLOCK_REALTIME of such a time where the recording tells, else this clock's; never below zero.
  std::uint64_t realtime_or_own(analysis::HostIndex host, std::int64_t time) const noexcept;
  // CLOCK_REALTIME less this clock; empty where the recording does not tell.
  std::optional<std::int64_t> realtime_offset() const noexcept { return realtime_offset_; }

 private:
  std::vector<analysis::Duration> shifts_;  // by host; empty: there is nothing to add
  analysis::Duration lift_{};               // of the summary's clock
  std::optional<std::int64_t> realtime_offset_;
};

}  // namespace cie::viewer_export
