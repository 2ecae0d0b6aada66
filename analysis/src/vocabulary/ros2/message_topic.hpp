// What is remembered of a topic's publications, until messages of it are taken.
#pragma once

#include "model/recent.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace cie::analysis::ros2 {

// How well tracers know the offset between their clock and CLOCK_REALTIME.
inline constexpr std::int64_t kOffsetError = 2'000;

// Small: a thousand are kept of every topic.
struct WrittenMessage {
  // `until` of a message that no layer below rclcpp was given: no take from these is of it.
  static constexpr auto kInProcess = std::numeric_limits<std::int64_t>::min();
  static constexpr auto kNone = std::numeric_limits<std::int64_t>::min();

  std::uint64_t gid = 0;      // of its publisher
  std::int64_t stamp = 0;     // by which the model knows it: CLOCK_REALTIME, unique
  std::int64_t name = kNone;  // by which the model knows it, if not by `stamp`
  std::int64_t from = 0;      // the writing lies between these two (CLOCK_REALTIME)
  std::int64_t until = std::numeric_limits<std::int64_t>::max();
  // The source timestamp that a take told of it; not of one that `is_exact`. One call writes one
  // message: any other timestamp between its two is of another writer.
  std::int64_t taken_as = kNone;
  bool is_exact = false;  // `stamp` is the source timestamp that takes will tell
  // What its thread did meanwhile may have been lost: that a message falls into the call is no proof.
  bool is_doubtful = false;

  std::int64_t known_as() const noexcept { return name != kNone ? name : stamp; }
};

// Agnocast's number of a message; each IPC namespace of each machine counts its own.
struct AgnocastEntry {
  std::uint32_t host = 0;
  std::int64_t number = 0;
  bool operator==(const AgnocastEntry&) const = default;
};

struct AgnocastMessage {
  AgnocastEntry entry{};
  std::int64_t pid = 0;  // whose publisher it is
};

class MessageTopic;

// One message of a topic, which may forget it meanwhile. Valid as long as the topic is.
class WrittenRef {
 public:
  WrittenRef() = default;

  explicit operator bool() const noexcept { return topic_ != nullptr; }
  // Null if there is no such message any more.
  WrittenMessage* get() const;
  void reset() noexcept { topic_ = nullptr; }

 private:
  friend class MessageTopic;
  WrittenRef(MessageTopic& topic, std::uint64_t number) : topic_(&topic), number_(number) {}

  MessageTopic* topic_ = nullptr;
  std::uint64_t number_ = 0;
};

class MessageTopic {
 public:
  static constexpr std::size_t kMost = 1024;  // waiting to be taken

  WrittenRef add(const WrittenMessage& publication,
                 const std::optional<AgnocastMessage>& agnocast = std::nullopt);
  // By the number that add() gave it.
  WrittenMessage* find(std::uint64_t number) {
    return is_remembered(number) ? &publications_.newest(told_ - 1 - number).message : nullptr;
  }

  void add_publisher(std::uint64_t gid) noexcept {
    ++publishers_;
    sole_publisher_ = publishers_ == 1 ? gid : 0;
  }
  std::size_t publishers() const noexcept { return publishers_; }
  // Of that of the topic's only publisher; 0 where there are more, or none.
  std::uint64_t sole_publisher() const noexcept { return sole_publisher_; }

  // A publication of one of its publishers was told in that channel; `former` is that of its publication
  // before, if there was one, and becomes this one's.
  void tell_in(std::uint32_t channel, std::optional<std::uint32_t>& former) {
    if (former == channel) return;
    move_channel(former, channel);
    former = channel;
  }
  // Channels of how many publishers' latest publication.
  const std::map<std::uint32_t, std::size_t>& told_in() const noexcept { return told_in_; }

  // A call of publish that began then (CLOCK_REALTIME) goes on: what it wrote may be taken before its source
  // timestamp is told.
  void begin_call(std::int64_t from) { going_on_.push_back(from); }
  void end_call(std::int64_t from) {
    const auto call = std::ranges::find(going_on_, from);
    if (call != going_on_.end()) going_on_.erase(call);
  }
  bool may_be_written_now(std::int64_t source_timestamp) const {
    return std::ranges::any_of(going_on_, [source_timestamp](std::int64_t from) {
      return from - kOffsetError <= source_timestamp;
    });
  }

  // Publications that a message of that source timestamp may be.
  struct Fitting {
    const WrittenMessage* exact = nullptr;
    std::size_t exact_count = 0;
    WrittenMessage* within = nullptr;  // a call that it falls into
    std::size_t within_count = 0;
  };
  Fitting fitting(std::int64_t source_timestamp);
  // As far as was seen.
  bool tells_timestamps() const;
  // No publication is remembered that was written before.
  std::int64_t known_from() const;
  // The first of those that there is no room for any more was written then, or later.
  std::int64_t forgotten_from() const noexcept { return forgotten_from_; }
  void forget_from(std::int64_t stamp) noexcept {
    forgotten_from_ = std::min(forgotten_from_, stamp);
  }
  // Messages used to fit publications. This one fits none, as those before it, and the latest
  // publications are those of no message: a clock was set.
  bool has_come_apart(std::int64_t source_timestamp);
  void note_fit() {
    has_fitted_ = true;
    misfits_ = 0;
  }
  bool has_unseen_writer() const noexcept { return has_unseen_writer_; }
  // The first message that shows one.
  bool note_unseen_writer() noexcept { return !std::exchange(has_unseen_writer_, true); }

  // The latest publication by that number of agnocast's; null if there is none.
  struct Entered {
    const WrittenMessage* message = nullptr;
    bool is_ambiguous = false;  // several processes published by that number
  };
  Entered find_entry(const AgnocastEntry& entry) const;
  bool has_forgotten() const noexcept {
    return forgotten_from_ != std::numeric_limits<std::int64_t>::max();
  }

 private:
  struct alignas(64) Written {
    WrittenMessage message;
    // Neither this message nor one before it was written later. Only of settled ones.
    std::int64_t none_after = 0;
  };
  static_assert(sizeof(Written) == 64, "a cache line: every publication writes one");
  struct Entry {
    AgnocastMessage agnocast;
    std::uint64_t number = 0;  // of the publication
  };
  bool is_remembered(std::uint64_t number) const noexcept {
    return told_ - 1 - number < publications_.size();
  }
  // Oldest first.
  Written& written(std::size_t place) {
    return publications_.newest(publications_.size() - 1 - place);
  }
  // Settled are the first messages, up to one of which it is not known yet when it was written at the
  // latest.
  void settle();
  void move_channel(std::optional<std::uint32_t> former, std::uint32_t channel);

  Recent<Written, kMost> publications_;
  Recent<Entry, kMost> entries_;  // of those that have one
  std::uint64_t told_ = 0;        // all publications, forgotten ones among them
  std::int64_t forgotten_from_ = std::numeric_limits<std::int64_t>::max();
  std::set<std::pair<std::uint32_t, std::int64_t>> entry_writers_;  // host and pid
  std::map<std::uint32_t, std::size_t> told_in_;
  std::vector<std::int64_t> going_on_;  // begins of calls
  std::size_t settled_ = 0;
  std::uint64_t sole_publisher_ = 0;
  std::size_t publishers_ = 0;
  bool has_fitted_ = false;
  bool has_unseen_writer_ = false;
  std::size_t misfits_ = 0;  // messages since one that fitted
  std::int64_t last_misfit_ = 0;
};

inline WrittenMessage* WrittenRef::get() const {
  return topic_ == nullptr ? nullptr : topic_->find(number_);
}

}  // namespace cie::analysis::ros2
