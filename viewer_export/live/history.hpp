// The latest snapshot, and what went before it as far as views show it.
#pragma once

#include "snapshot.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>

namespace cie::live {

class History {
 public:
  static constexpr std::size_t kMaxInstances = 256;  // per callback
  static constexpr std::size_t kMaxChanges = 500;

  void add(Snapshot snapshot);

  const Snapshot& latest() const noexcept { return latest_; }
  // Instances of a callback, by CallbackView::index, oldest first.
  const std::deque<RecentInstance>& instances(std::uint32_t callback) const;
  // Oldest first.
  const std::deque<VerdictChange>& changes() const noexcept { return changes_; }

 private:
  Snapshot latest_;
  std::map<std::uint32_t, std::deque<RecentInstance>> instances_;
  std::deque<VerdictChange> changes_;
};

}  // namespace cie::live
