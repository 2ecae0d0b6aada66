#include "host_clocks.hpp"

#include <algorithm>
#include <vector>

namespace cie::analysis {
namespace {

const HostClockFacts* find(const Model& model, HostPair from_to) {
  const auto found = model.host_clocks.find(from_to);
  return found == model.host_clocks.end() ? nullptr : &found->second;
}

}  // namespace

void HostClocks::apply(HostIndex host, const StreamBegin& event) {
  if (event.clock_offset_ns != 0) offsets_[host].of_metadata = event.clock_offset_ns;
}

void HostClocks::apply(HostIndex host, const ClockSync& event) {
  offsets_[host].of_process = detail::wrapping_sub(event.realtime_ns, event.monotonic_ns);
}

std::optional<std::int64_t> HostClocks::synced(HostIndex host) const noexcept {
  const auto* offsets = offsets_.find(host);
  return offsets == nullptr ? std::nullopt : offsets->of_process;
}

std::optional<Timestamp> HostClocks::local(HostIndex host,
                                           std::int64_t realtime_ns) const noexcept {
  const auto* offsets = offsets_.find(host);
  if (offsets == nullptr) return std::nullopt;
  const auto& offset = offsets->of_process ? offsets->of_process : offsets->of_metadata;
  if (!offset) return std::nullopt;
  return Timestamp{detail::wrapping_sub(realtime_ns, *offset)};
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

const HostFacts* reference_host(const Model& model) noexcept {
  const auto first = std::ranges::min_element(model.hosts, {}, &HostFacts::name);
  return first == model.hosts.end() ? nullptr : &*first;
}

Duration clock_shift(const HostFacts& from, const HostFacts& to) noexcept {
  if (!from.clock_offset_ns || !to.clock_offset_ns) return {};
  constexpr std::int64_t kSameClock = 1'000'000'000;  // offsets are measured less well than that
  const Duration shift{detail::wrapping_sub(*from.clock_offset_ns, *to.clock_offset_ns)};
  const bool is_same_boot = from.clock_uuid == to.clock_uuid && !from.clock_uuid.empty();
  return is_same_boot && shift.ns < kSameClock && shift.ns > -kSameClock ? Duration{} : shift;
}

ClockError clock_error(const Model& model, HostPair from_to) {
  ClockError error;
  if (const auto* there = find(model, from_to)) error.least = Duration{} - there->shortest;
  if (const auto* back = find(model, {from_to.second, from_to.first})) error.most = back->shortest;
  return error;
}

std::optional<ClockError> clock_error(const Model& model, const ChainFacts& chain) {
  // The way back takes off what the way there adds.
  std::vector<HostPair> ways;
  for (const auto& pair : chain.crosses) {
    if (!pair) continue;
    const auto opposite = std::ranges::find(ways, HostPair{pair->second, pair->first});
    if (opposite == ways.end()) {
      ways.push_back(*pair);
    } else {
      ways.erase(opposite);
    }
  }
  std::optional<ClockError> sum;
  const auto add = [](std::optional<Duration>& to, const std::optional<Duration>& bound) {
    to = to && bound ? std::optional(*to + *bound) : std::nullopt;
  };
  for (const auto& way : ways) {
    const auto error = clock_error(model, way);
    if (!sum) sum = ClockError{.least = Duration{}, .most = Duration{}};
    add(sum->least, error.least);
    add(sum->most, error.most);
  }
  return sum;
}

}  // namespace cie::analysis
