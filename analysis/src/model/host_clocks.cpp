#include "host_clocks.hpp"

#include <algorithm>
#include <vector>

namespace cie::analysis {
namespace {

const HostClockFacts* find(const Model& model, HostPair from_to) {
  const auto found = model.host_clocks.find(from_to);
  return found == model.host_clocks.end() ? nullptr : &found->second;
}

// The way back takes off what the way there adds, unless a clock was set in between.
std::optional<ClockError> error_along(const Model& model, const HostRoute& route) {
  for (const auto& pair : route)
    if (pair && is_any_clock_set(model, *pair)) return ClockError{};
  std::vector<HostPair> ways;
  for (const auto& pair : route) {
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

// What holds whichever of the two applies; a contradiction stays one.
ClockError either(const ClockError& a, const ClockError& b) {
  if (a.is_contradiction()) return a;
  if (b.is_contradiction()) return b;
  ClockError error;
  if (a.least && b.least) error.least = std::min(*a.least, *b.least);
  if (a.most && b.most) error.most = std::max(*a.most, *b.most);
  return error;
}

// Routes without an error read their times on one clock.
template <typename ErrorOf>
std::optional<ClockError> of_any_route(const ChainFacts& chain, const ErrorOf& error_of) {
  constexpr ClockError kNone{.least = Duration{}, .most = Duration{}};
  std::optional<ClockError> error;
  bool is_exact_on_some = false;
  for (const auto& route : chain.routes) {
    if (const auto of_route = error_of(route)) {
      error = error ? either(*error, *of_route) : *of_route;
    } else {
      is_exact_on_some = true;
    }
  }
  return error && is_exact_on_some ? either(*error, kNone) : error;
}

}  // namespace

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

const HostFacts* reference_host(const Model& model) noexcept {
  const auto first = std::ranges::min_element(model.hosts, {}, &HostFacts::name);
  return first == model.hosts.end() ? nullptr : &*first;
}

bool is_any_clock_set(const Model& model, HostPair hosts) {
  return model.hosts[at(hosts.first)].is_clock_set || model.hosts[at(hosts.second)].is_clock_set;
}

Duration clock_shift(const HostFacts& from, const HostFacts& to) noexcept {
  if (!from.clock_offset_ns || !to.clock_offset_ns) return {};
  const bool is_same_boot = from.clock_uuid == to.clock_uuid && !from.clock_uuid.empty();
  if (is_same_boot && detail::are_alike(*from.clock_offset_ns, *to.clock_offset_ns)) return {};
  return {detail::wrapping_sub(*from.clock_offset_ns, *to.clock_offset_ns)};
}

void require_one_clock(const Model& model) {
  const auto* reference = reference_host(model);
  for (const auto& host : model.hosts) {
    const bool is_related = host.clock_uuid == reference->clock_uuid ||
                            (host.clock_offset_ns && reference->clock_offset_ns);
    if (is_related && clock_shift(host, *reference) == Duration{}) continue;
    throw SeveralClocks(
        "a window is by one clock, and the recording is of machines that have their "
        "own, as \"" +
        reference->name + "\" and \"" + host.name + "\"; name one machine's directory");
  }
}

ClockError clock_error(const Model& model, HostPair from_to) {
  ClockError error;
  if (is_any_clock_set(model, from_to)) return error;
  if (const auto* there = find(model, from_to)) error.least = Duration{} - there->shortest;
  if (const auto* back = find(model, {from_to.second, from_to.first})) error.most = back->shortest;
  return error;
}

std::optional<ClockError> clock_error(const Model& model, const ChainFacts& chain) {
  return of_any_route(chain,
                      [&model](const HostRoute& route) { return error_along(model, route); });
}

std::optional<ClockError> clock_error(const Model& model, const ChainFacts& chain,
                                      std::size_t message) {
  return of_any_route(chain, [&](const HostRoute& route) {
    return route[message] ? std::optional(clock_error(model, *route[message])) : std::nullopt;
  });
}

}  // namespace cie::analysis
