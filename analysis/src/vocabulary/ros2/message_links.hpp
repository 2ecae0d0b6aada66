// Which publication a taken message is: by topic and source timestamp, or where the publishing side
// does not tell timestamps (Humble), by the one call of publish that the timestamp falls into.
#pragma once

#include "message_topic.hpp"

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <unordered_map>

namespace cie::analysis::ros2 {

class MessageLinks {
 public:
  // It stays where it is.
  MessageTopic& topic(const std::string& name) { return topics_[name]; }
  // For a publisher that is announced: other writers have ids drawn by DDS.
  std::uint64_t new_gid() noexcept { return kFirstGid + ++publishers_; }
  // What publishers write from then on (CLOCK_REALTIME) that was told there is told no more, unless in
  // another channel.
  void end_channel(std::uint32_t channel, std::int64_t realtime) {
    ended_.insert_or_assign(channel, realtime);
  }

  // What the message of that source timestamp is called in the model: publisher and stamp. No
  // publisher: it cannot be told which one wrote it.
  struct Origin {
    std::uint64_t gid = 0;
    std::int64_t stamp = 0;
    bool is_undecided = false;  // no publisher, and some of the recorded publications may be it
    // The first message that shows a writer of the topic whose publications are not recorded.
    bool shows_unseen_writer = false;
  };
  static constexpr auto kAll = std::numeric_limits<std::int64_t>::max();
  // When a message was taken, as far as it matters which one it is.
  struct Take {
    // By the clock that calls of publish are told by: nothing was written later, but by another clock.
    std::int64_t at = kAll;
    // What was written later may not have been told yet, as another host's clock may be ahead.
    std::int64_t told_until = kAll;
  };
  Origin find(const std::string& topic, std::int64_t source_timestamp, const Take& take);
  Origin find(const std::string& topic, std::int64_t source_timestamp) {
    return find(topic, source_timestamp, Take{});
  }
  // The latest publication by that number. Undecided where several processes published by it: they
  // are in several IPC namespaces, or the topic began anew in between, and no event tells which.
  Origin find_entry(const std::string& topic, const AgnocastEntry& entry) const;

  // Of what somebody published who was never announced, on whichever topic.
  MessageTopic& unannounced() noexcept { return unannounced_; }

  // Publications may have been lost: whoever alone publishes on a topic may have written what no
  // publication fits.
  void lose() noexcept { has_lost_ = true; }

  bool has_lost() const noexcept { return has_lost_; }

  bool has_any() const noexcept { return !topics_.empty(); }

  // Nothing will be taken any more. References to topics are void afterwards.
  void forget_messages() noexcept { topics_.clear(); }

 private:
  static constexpr std::uint64_t kFirstGid = 0x726f'7332'0000'0000U;  // "ros2", then a number

  bool may_be_unannounced(std::int64_t source_timestamp);
  // A publisher of the topic may have written then what no channel tells any more.
  bool may_write_unrecorded(const MessageTopic& topic, std::int64_t source_timestamp) const;

  std::unordered_map<std::string, MessageTopic> topics_;
  MessageTopic unannounced_;
  std::map<std::uint32_t, std::int64_t> ended_;  // channels: CLOCK_REALTIME
  std::uint64_t publishers_ = 0;
  bool has_lost_ = false;
};

}  // namespace cie::analysis::ros2
