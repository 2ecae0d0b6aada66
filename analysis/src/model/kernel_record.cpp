#include "kernel_record.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

// Those that overlap, or between which no time lies, as one.
std::vector<Stretch> united(std::vector<Stretch> stretches) {
  std::ranges::sort(stretches, {}, &Stretch::begin);
  std::vector<Stretch> all;
  for (const auto& stretch : stretches) {
    const bool goes_on = !all.empty() && (stretch.begin <= all.back().end ||
                                          stretch.begin.ns - 1 == all.back().end.ns);
    if (goes_on) {
      all.back().end = std::max(all.back().end, stretch.end);
    } else {
      all.push_back(stretch);
    }
  }
  return all;
}

std::vector<Stretch> common(const std::vector<Stretch>& some, const std::vector<Stretch>& others) {
  std::vector<Stretch> all;
  auto one = some.begin();
  auto other = others.begin();
  while (one != some.end() && other != others.end()) {
    const Stretch both{.begin = std::max(one->begin, other->begin),
                       .end = std::min(one->end, other->end)};
    if (both.begin <= both.end) all.push_back(both);
    ++(one->end < other->end ? one : other);
  }
  return all;
}

using Parts = std::vector<const KernelPart*>;

std::vector<Stretch> of_cpu(const Parts& parts, std::optional<std::int32_t> cpu) {
  std::vector<Stretch> stretches;
  for (const auto* part : parts) {
    const bool has_cpu = !cpu || part->cpus.empty() || part->cpus.contains(*cpu);
    if (has_cpu && part->covers) stretches.push_back(*part->covers);
  }
  return united(std::move(stretches));
}

std::vector<Stretch> of_all_cpus(const Parts& parts) {
  std::set<std::int32_t> cpus;
  for (const auto* part : parts)
    cpus.insert(part->cpus.begin(), part->cpus.end());
  auto stretches = of_cpu(parts, std::nullopt);
  for (const auto cpu : cpus)
    stretches = common(stretches, of_cpu(parts, cpu));
  return stretches;
}

}  // namespace

std::vector<Stretch> recorded(const std::vector<KernelPart>& parts,
                              std::optional<std::int32_t> cpu) {
  Parts with_switches;
  Parts without;
  for (const auto& part : parts)
    (part.has_switches ? with_switches : without).push_back(&part);
  if (with_switches.empty()) with_switches.swap(without);
  auto stretches = cpu ? of_cpu(with_switches, cpu) : of_all_cpus(with_switches);
  return without.empty() ? stretches : common(stretches, of_all_cpus(without));
}

}  // namespace cie::analysis
