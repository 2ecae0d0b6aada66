// Which publication a taken message is: by topic and source timestamp, or where the publishing side
// does not tell timestamps (Humble), by the one call of publish that the timestamp falls into.
#pragma once

#include <cie/analysis/event.hpp>

#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

namespace cie::analysis::ros2 {

// How well tracers know the offset between their clock and CLOCK_REALTIME.
inline constexpr std::int64_t kOffsetError = 2'000;

struct WrittenMessage {
  // `until` of a message that no layer below rclcpp was given: no take from these is of it.
  static constexpr auto kInProcess = std::numeric_limits<std::int64_t>::min();

  std::uint64_t gid = 0;               // of its publisher
  std::int64_t stamp = 0;              // by which the model knows it: CLOCK_REALTIME, unique
  bool is_exact = false;               // `stamp` is the source timestamp that takes will tell
  std::optional<std::int64_t> name{};  // by which the model knows it, if not by `stamp`
  std::int64_t from = 0;               // the writing lies between these two (CLOCK_REALTIME)
  std::int64_t until = std::numeric_limits<std::int64_t>::max();
  // Agnocast's number of the message; each IPC namespace of each machine counts its own.
  struct Entry {
    std::uint32_t host = 0;
    std::int64_t number = 0;
    bool operator==(const Entry&) const = default;
  };
  std::optional<Entry> entry{};
  std::int64_t pid = 0;  // whose publisher it is; only where there is an entry
  // The source timestamp that a take told of it; not of one that `is_exact`. One call writes one
  // message: any other timestamp between its two is of another writer.
  std::optional<std::int64_t> taken_as{};
  // What its thread did meanwhile may have been lost: that a message falls into the call is no proof.
  bool is_doubtful = false;
};

class MessageLinks {
 public:
  std::shared_ptr<WrittenMessage> add(const std::string& topic, const WrittenMessage& publication);
  // For a publisher that is announced: other writers have ids drawn by DDS.
  std::uint64_t new_gid() noexcept { return kFirstGid + ++publishers_; }
  // A publisher of the topic was announced.
  void add_publisher(const std::string& topic, std::uint64_t gid);
  // A publication of one of the topic's publishers was told in that channel; `former` is that of its
  // publication before, if there was one, and becomes this one's.
  void tell_in(const std::string& topic, std::uint32_t channel,
               std::optional<std::uint32_t>& former) {
    if (former == channel) return;
    move_teller(topics_[topic], former, channel);
    former = channel;
  }
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
  Origin find_entry(const std::string& topic, const WrittenMessage::Entry& entry) const;

  // A message was published by somebody who was never announced, on whichever topic.
  std::shared_ptr<WrittenMessage> add_unannounced(const WrittenMessage& publication) {
    return unannounced_.add(publication);
  }

  // Publications may have been lost: whoever alone publishes on a topic may have written what no
  // publication fits.
  void lose() noexcept { has_lost_ = true; }

  bool has_lost() const noexcept { return has_lost_; }

  bool has_any() const noexcept { return !topics_.empty(); }

 private:
  static constexpr std::uint64_t kFirstGid = 0x726f'7332'0000'0000U;  // "ros2", then a number

  struct Written {
    std::shared_ptr<WrittenMessage> message;
    // Neither this message nor one before it was written later. Only of settled ones.
    std::int64_t none_after = 0;
  };
  // Publications that a message may be.
  struct Fitting {
    const WrittenMessage* exact = nullptr;
    std::size_t exact_count = 0;
    WrittenMessage* within = nullptr;  // a call that it falls into
    std::size_t within_count = 0;
  };
  struct Topic {
    std::shared_ptr<WrittenMessage> add(const WrittenMessage& publication);
    Fitting fitting(std::int64_t source_timestamp);
    // Settled are the first messages, up to one of which it is not known yet when it was written at the
    // latest.
    void settle();
    // As far as was seen.
    bool tells_timestamps() const {
      if (publications.empty()) return true;
      const auto& latest = *publications.back().message;
      return latest.is_exact || latest.is_doubtful;
    }
    // No publication is remembered that was written before.
    std::int64_t known_from() const;
    bool has_forgotten() const noexcept {
      return forgotten_from != std::numeric_limits<std::int64_t>::max();
    }
    // Messages used to fit publications. This one fits none, as those before it, and the latest
    // publications are those of no message: a clock was set.
    bool has_come_apart(std::int64_t source_timestamp);
    void note_fit() {
      has_fitted = true;
      misfits = 0;
    }

    std::deque<Written> publications{};
    // The first of those that there is no room for any more was written then, or later.
    std::int64_t forgotten_from = std::numeric_limits<std::int64_t>::max();
    std::set<std::pair<std::uint32_t, std::int64_t>> entry_writers{};  // host and pid
    std::map<std::uint32_t, std::size_t> told_in{};  // channels of how many publishers' latest
    std::size_t settled = 0;
    std::uint64_t sole_publisher = 0;
    std::size_t publishers = 0;
    bool has_fitted = false;
    bool has_unseen_writer = false;
    std::size_t misfits = 0;  // messages since one that fitted
    std::int64_t last_misfit = 0;
  };
  bool may_be_unannounced(std::int64_t source_timestamp);
  static void move_teller(Topic& topic, std::optional<std::uint32_t> former, std::uint32_t channel);
  // A publisher of the topic may have written then what no channel tells any more.
  bool is_told_no_more(const Topic& topic, std::int64_t source_timestamp) const;

  std::unordered_map<std::string, Topic> topics_;
  Topic unannounced_;
  std::map<std::uint32_t, std::int64_t> ended_;  // channels: CLOCK_REALTIME
  std::uint64_t publishers_ = 0;
  bool has_lost_ = false;
};

}  // namespace cie::analysis::ros2
