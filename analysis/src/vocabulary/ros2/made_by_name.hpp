// How many of those of one name were made before a time.
#pragma once

#include <cie/analysis/event.hpp>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

// Whoever is counted stands under a key of its own.
template <typename Key>
class MadeByName {
 public:
  void put(const Key& key, std::string name, Timestamp made) {
    remove(key);
    const auto all = by_name_.try_emplace(name).first;
    all->second.insert(std::ranges::upper_bound(all->second, made), made);
    counted_.emplace(key, std::pair(std::move(name), made));
  }
  // It need not be there.
  void remove(const Key& key) {
    const auto found = counted_.find(key);
    if (found == counted_.end()) return;
    auto& all = by_name_.find(found->second.first)->second;
    all.erase(std::ranges::lower_bound(all, found->second.second));
    counted_.erase(found);
  }
  std::uint32_t count_before(std::string_view name, Timestamp time) const {
    const auto all = by_name_.find(name);
    if (all == by_name_.end()) return 0;
    const auto first = std::ranges::lower_bound(all->second, time);
    return static_cast<std::uint32_t>(first - all->second.begin());
  }

 private:
  std::map<Key, std::pair<std::string, Timestamp>> counted_;
  std::map<std::string, std::vector<Timestamp>, std::less<>> by_name_;  // in order of time
};

}  // namespace cie::analysis::ros2
