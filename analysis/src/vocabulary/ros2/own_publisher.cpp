#include "own_publisher.hpp"

#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

void pass_on(std::span<OwnPublisher* const> publishers, MessageTopic& topic) {
  std::vector<std::pair<std::int64_t, std::uint64_t>> messages;  // when, by whom
  for (auto* publisher : publishers) {
    publisher->unasked.for_each(
        [&](std::int64_t stamp) { messages.emplace_back(stamp, publisher->gid); });
    topic.forget_from(publisher->forgotten_from);
    publisher->unasked = {};
  }
  std::ranges::stable_sort(messages, {}, &std::pair<std::int64_t, std::uint64_t>::first);
  for (const auto& [stamp, gid] : messages)
    topic.add({.gid = gid, .stamp = stamp, .is_exact = true});
}

}  // namespace cie::analysis::ros2
