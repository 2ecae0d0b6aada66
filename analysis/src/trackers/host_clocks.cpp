#include "host_clocks.hpp"

#include <algorithm>

namespace cie::analysis {

void HostClocks::apply(HostIndex host, const StreamBegin& event) {
  if (event.clock_offset_ns != 0) offsets_[host].of_metadata = event.clock_offset_ns;
}

void HostClocks::apply(HostIndex host, const RunBegin& event) {
  if (event.realtime_ns == 0) return;  // the recording does not tell
  sync(host, event.monotonic_ns, event.realtime_ns);
}

void HostClocks::apply(HostIndex host, const ClockSync& event) {
  sync(host, event.monotonic_ns, event.realtime_ns);
}

void HostClocks::apply_shown(HostIndex host, const ClockSync& event) {
  auto& shown = offsets_[host].of_process;
  const auto offset = detail::wrapping_sub(event.realtime_ns, event.monotonic_ns);
  if (shown && is_step(*shown, offset)) model_.hosts[at(host)].is_clock_set = true;
  shown = offset;
}

bool HostClocks::is_step(std::int64_t one_offset, std::int64_t other_offset) noexcept {
  const auto [less, more] = std::minmax(one_offset, other_offset);
  return detail::wrapping_sub(more, less) > kLeastStep.ns;
}

void HostClocks::sync(HostIndex host, std::int64_t monotonic_ns, std::int64_t realtime_ns) {
  auto& offsets = offsets_[host];
  const auto offset = detail::wrapping_sub(realtime_ns, monotonic_ns);
  const auto former = offsets.last_read.value_or(offset);
  const Timestamp now{monotonic_ns};
  if (is_step(former, offset)) {
    model_.hosts[at(host)].is_clock_set = true;
    if (offsets.steps.size() >= kMostSteps) offsets.steps.pop_front();
    offsets.steps.push_back(
        {.after = offsets.read_at, .until = now, .larger_offset = std::max(former, offset)});
  }
  offsets.of_process = offsets.last_read = offset;
  offsets.read_at = std::max(offsets.read_at, now);
}

bool HostClocks::were_read_since(HostIndex host, Timestamp time) const noexcept {
  const auto* offsets = offsets_.find(host);
  return offsets != nullptr && offsets->last_read && offsets->read_at >= time;
}

bool HostClocks::may_be_set_between(HostIndex host, std::int64_t realtime_ns,
                                    Timestamp until) const noexcept {
  const auto* offsets = offsets_.find(host);
  if (offsets == nullptr) return false;
  return std::ranges::any_of(offsets->steps, [&](const Step& step) {
    if (step.after >= until) return false;
    const Timestamp earliest{detail::wrapping_sub(realtime_ns, step.larger_offset)};
    return earliest <= step.until;
  });
}

const std::optional<std::int64_t>& HostClocks::latest(HostIndex host) const noexcept {
  const auto* offsets = offsets_.find(host);
  if (offsets == nullptr) return kNoOffset;
  return offsets->of_process ? offsets->of_process : offsets->of_metadata;
}

std::optional<Timestamp> HostClocks::local(HostIndex host,
                                           std::int64_t realtime_ns) const noexcept {
  const auto& offset = latest(host);
  if (!offset) return std::nullopt;
  return Timestamp{detail::wrapping_sub(realtime_ns, *offset)};
}

std::optional<Timestamp> HostClocks::local(HostIndex host, HostIndex other,
                                           Timestamp time) const noexcept {
  const auto& offset = latest(other);
  if (!offset) return std::nullopt;
  return local(host, detail::wrapping_add(time.ns, *offset));
}

void HostClocks::note_message(HostIndex from, HostIndex to, Duration shown) {
  const HostPair pair{from, to};
  if (last_ == nullptr || pair != last_pair_) {
    last_ = &model_.host_clocks[pair];
    last_pair_ = pair;
  }
  last_->shortest = last_->messages == 0 ? shown : std::min(last_->shortest, shown);
  ++last_->messages;
}

}  // namespace cie::analysis
