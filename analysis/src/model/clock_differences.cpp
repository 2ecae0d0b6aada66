#include "clock_differences.hpp"

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
