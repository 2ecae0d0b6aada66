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
  // Of each callback or group a list, in the order in which they were added.
  class Lists {
   public:
    using Key = std::pair<ProcessIndex, std::uint32_t>;
    void add(Key key, ThreadIndex thread) { entries_.push_back({key, thread}); }
    // After the last one was added.
    void sort();
    std::vector<ThreadIndex> of(Key key) const;

   private:
    std::vector<std::pair<Key, ThreadIndex>> entries_;
  };

  std::tuple<Timestamp, std::int64_t, ThreadIndex> order(ThreadIndex index) const;
  void add(ThreadIndex index, const std::optional<CallbackId>& callback,
           const std::optional<GroupId>& of_group);
  void find_idle_owners(const std::vector<ThreadIndex>& isolated);

  const Model& model_;
  // Each list in order.
  Lists by_callback_;
  Lists by_group_;          // announced for it
  Lists without_callback_;  // of them, those that name no callback
  std::map<ThreadIndex, CallbackIndex> idle_owners_;
};

}  // namespace cie::analysis
