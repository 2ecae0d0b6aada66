// A publisher of which this project's events tell, and what it published that somebody may take of whom
// ROS 2's events tell.
#pragma once

#include "message_topic.hpp"
#include "model/recent.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>

namespace cie::analysis::ros2 {

// What every publication touches comes first.
struct OwnPublisher {
  MessageTopic* messages = nullptr;        // of its topic, once it was seen to publish
  std::optional<std::uint32_t> told_in{};  // the channel of its latest publication
  // Source timestamps of what it published, as long as nobody asked for messages: here they take an
  // eighth of the room. The last ones, as many as a topic remembers.
  Recent<std::int64_t, MessageTopic::kMost> unasked{};
  std::int64_t forgotten_from = std::numeric_limits<std::int64_t>::max();  // as of a topic
  std::uint64_t gid = 0;
  std::string topic{};

  void keep(std::int64_t stamp) {
    if (unasked.size() == MessageTopic::kMost)
      forgotten_from = std::min(forgotten_from, unasked.newest(MessageTopic::kMost - 1));
    unasked.push(stamp);
  }
};

// The topic is to have what these published on it, as if it had been told each at once.
void pass_on(std::span<OwnPublisher* const> publishers, MessageTopic& topic);

}  // namespace cie::analysis::ros2
