#include "common_clock.hpp"

#include <algorithm>

namespace cie::viewer_export {

using analysis::Duration;
using analysis::HostReport;

CommonClock::CommonClock(const analysis::Report& report)
    : realtime_offset_(report.trace.clock_offset_ns) {
  const auto& hosts = report.hosts;
  if (hosts.size() < 2) return;
  const auto is_zero = [](const HostReport& host) { return host.shift == Duration{}; };
  if (std::ranges::all_of(hosts, is_zero)) return;
  const auto longest = std::ranges::min_element(hosts, {}, &HostReport::shift);
  lift_ = std::max(Duration{} - longest->shift, Duration{});
  const auto is_known = [](const HostReport& host) { return host.clock_offset_ns.has_value(); };
  realtime_offset_ = std::ranges::all_of(hosts, is_known) ? longest->clock_offset_ns : std::nullopt;
  for (const auto& host : hosts)
    shifts_.push_back(host.shift + lift_);
}

std::uint64_t CommonClock::realtime_or_own(analysis::HostIndex host,
                                           std::int64_t time) const noexcept {
  const auto common = of(host, time);
  std::int64_t moved = 0;
  const bool is_none = __builtin_add_overflow(common, realtime_offset_.value_or(0), &moved);
  return static_cast<std::uint64_t>(
      std::max<std::int64_t>(is_none || moved < 0 ? common : moved, 0));
}

}  // namespace cie::viewer_export
