#include "user_losses.hpp"

#include <algorithm>
#include <iterator>

namespace cie::analysis {

UserLosses::UserLosses(const Model& model) {
  for (const auto& loss : model.losses) {
    if (!loss.is_evidence || loss.domain == Domain::kernel) continue;
    losses_[loss.host].push_back({.begin = loss.begin, .last = &loss});
    of_cpus_[loss.host][loss.cpu].push_back({.begin = loss.begin, .last = &loss});
  }
  for (auto& [host, losses] : losses_)
    sort(losses);
  for (auto& [host, cpus] : of_cpus_) {
    for (auto& [cpu, losses] : cpus)
      sort(losses);
  }
}

void UserLosses::sort(ByBegin& losses) {
  std::ranges::stable_sort(losses, {}, &UpTo::begin);
  const Loss* last = losses.front().last;
  for (auto& up_to : losses) {
    if (last->end < up_to.last->end) last = up_to.last;
    up_to.last = last;
  }
}

const Loss* UserLosses::between(const ByBegin& losses, Timestamp begin, Timestamp end) {
  const auto next = std::ranges::upper_bound(losses, end, {}, &UpTo::begin);
  if (next == losses.begin()) return nullptr;
  const auto* last = std::prev(next)->last;
  return last->end >= begin ? last : nullptr;
}

const Loss* UserLosses::between(HostIndex host, Timestamp begin, Timestamp end) const {
  const auto found = losses_.find(host);
  return found != losses_.end() ? between(found->second, begin, end) : nullptr;
}

std::vector<std::optional<std::int32_t>> UserLosses::cpus_between(HostIndex host, Timestamp begin,
                                                                  Timestamp end) const {
  std::vector<std::optional<std::int32_t>> cpus;
  const auto found = of_cpus_.find(host);
  if (found == of_cpus_.end()) return cpus;
  for (const auto& [cpu, losses] : found->second)
    if (between(losses, begin, end) != nullptr) cpus.push_back(cpu);
  return cpus;
}

}  // namespace cie::analysis
