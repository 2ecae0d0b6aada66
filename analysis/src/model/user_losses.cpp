#include "user_losses.hpp"

#include <algorithm>
#include <iterator>

namespace cie::analysis {

UserLosses::UserLosses(const Model& model) {
  for (const auto& loss : model.losses) {
    if (loss.is_evidence && loss.domain != Domain::kernel)
      losses_[loss.host].push_back({.begin = loss.begin, .last = &loss});
  }
  for (auto& [host, losses] : losses_) {
    std::ranges::stable_sort(losses, {}, &UpTo::begin);
    const Loss* last = losses.front().last;
    for (auto& up_to : losses) {
      if (last->end < up_to.last->end) last = up_to.last;
      up_to.last = last;
    }
  }
}

const Loss* UserLosses::between(HostIndex host, Timestamp begin, Timestamp end) const {
  const auto found = losses_.find(host);
  if (found == losses_.end()) return nullptr;
  const auto& losses = found->second;
  const auto next = std::ranges::upper_bound(losses, end, {}, &UpTo::begin);
  if (next == losses.begin()) return nullptr;
  const auto* last = std::prev(next)->last;
  return last->end >= begin ? last : nullptr;
}

}  // namespace cie::analysis
