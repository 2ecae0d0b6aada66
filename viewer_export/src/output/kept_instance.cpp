#include "kept_instance.hpp"

#include <algorithm>

namespace cie::viewer_export {

KeptInstance KeptInstance::of(const analysis::Instance& i) {
  KeptInstance kept{.start = i.start.ns,
                    .tid = i.tid,
                    .callback = i.callback,
                    .process = i.process,
                    .seq = i.seq,
                    .source_timestamp = i.source_timestamp_realtime_ns,
                    .writer_gid = i.writer_gid,
                    .release_source = i.release_source,
                    .state = i.state,
                    .status = i.status};
  // Without any sign of a release the start itself is the bound.
  const bool is_start = i.release_source == analysis::ReleaseSource::start;
  kept.numbers.keep(release, !i.release && is_start ? std::optional(i.start) : i.release);
  kept.numbers.keep(wakeup, i.wakeup);
  kept.numbers.keep(end, i.end);
  kept.numbers.keep(cpu_start, i.cpu_start);
  kept.numbers.keep(cpu_end, i.cpu_end);
  kept.numbers.keep(execution, i.execution);
  kept.numbers.keep(preempted, i.preempted);
  kept.numbers.keep(blocked, i.blocked);
  kept.numbers.keep(waking, i.waking);
  kept.numbers.keep(wake_delay, i.wake_delay);
  kept.numbers.keep(missed, i.missed);
  return kept;
}

std::optional<std::int64_t> KeptInstance::response() const {
  if (!numbers.is_known(release) || !numbers.is_known(end) || !is_known(release_source)) {
    return std::nullopt;
  }
  return numbers.value(end) - numbers.value(release);
}

std::optional<std::int64_t> KeptInstance::least_start_latency() const {
  if (!numbers.is_known(release) || release_source == analysis::ReleaseSource::source_timestamp) {
    return std::nullopt;
  }
  return start - numbers.value(release);
}

std::optional<std::int64_t> KeptInstance::least_response() const {
  if (!numbers.is_known(end)) return std::nullopt;
  const auto waited = std::max(least_start_latency().value_or(0), std::int64_t{0});
  return waited + numbers.value(end) - start;
}

TakenBackReleases::TakenBackReleases(const analysis::Report& report) {
  for (const auto& callback : report.callbacks) {
    const auto number = analysis::at(callback.index);
    if (number >= has_releases_.size()) has_releases_.resize(number + 1, true);
    has_releases_[number] = callback.response_time.has_value();
  }
}

KeptInstance TakenBackReleases::corrected(KeptInstance row) const {
  const auto number = analysis::at(row.callback);
  const bool is_taken_back = row.release_source == analysis::ReleaseSource::timer_grid &&
                             number < has_releases_.size() && !has_releases_[number];
  if (is_taken_back) {
    row.release_source = analysis::ReleaseSource::start;
    row.numbers.keep(KeptInstance::release, std::optional(row.start));
    row.numbers.forget(KeptInstance::missed);
  }
  return row;
}

}  // namespace cie::viewer_export
