// The isolated threads of every callback and group.
#pragma once

#include "model/facts.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {

class IsolatedThreads {
 public:
  explicit IsolatedThreads(const Model& model);
  // Those registered to the callback, or serving the group, by time of announcement.
  std::vector<ThreadIndex> of(const CallbackFacts& callback) const;
  std::vector<ThreadIndex> of(const GroupFacts& group) const;
  // Whose thread it is, of one that ran no callback of its own.
  std::optional<CallbackIndex> idle_owner(ThreadIndex thread) const;

 private:
  using Threads = std::map<std::pair<ProcessIndex, std::uint32_t>, std::vector<ThreadIndex>>;

  std::tuple<Timestamp, std::int64_t, ThreadIndex> order(ThreadIndex index) const;
  void find_idle_owners(const std::vector<ThreadIndex>& isolated);

  const Model& model_;
  // Each list in order.
  Threads by_callback_;
  Threads by_group_;          // announced for it
  Threads without_callback_;  // of them, those that name no callback
  std::map<ThreadIndex, CallbackIndex> idle_owners_;
};

}  // namespace cie::analysis
