#include "history.hpp"

#include <algorithm>
#include <utility>

namespace cie::live {

void History::add(Snapshot snapshot) {
  std::map<std::uint32_t, std::deque<RecentInstance>> kept;
  for (auto& callback : snapshot.callbacks) {
    auto& instances = kept[callback.index] = std::move(instances_[callback.index]);
    for (auto& instance : callback.recent)
      instances.push_back(instance);
    while (instances.size() > kMaxInstances)
      instances.pop_front();
  }
  instances_ = std::move(kept);
  for (const auto& change : snapshot.changes)
    changes_.push_back(change);
  while (changes_.size() > kMaxChanges)
    changes_.pop_front();
  latest_ = std::move(snapshot);
}

const std::deque<RecentInstance>& History::instances(std::uint32_t callback) const {
  static const std::deque<RecentInstance> none;
  const auto found = instances_.find(callback);
  return found == instances_.end() ? none : found->second;
}

}  // namespace cie::live
