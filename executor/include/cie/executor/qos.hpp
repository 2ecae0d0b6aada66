// Quality of service of a publisher or subscription, under the names a ROS 2 user knows.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace cie {

enum class Reliability : std::uint8_t { reliable, best_effort };
enum class Durability : std::uint8_t { volatile_only, transient_local };
enum class History : std::uint8_t { keep_last, keep_all };
// What shows that a writer is alive: its process being alive, or the writer itself, by publishing
// and by Publisher::assert_liveliness().
enum class Liveliness : std::uint8_t { automatic, manual_by_topic };

struct KeepLast {
  std::uint32_t depth;
};
struct KeepAll {};

// A value; the default is reliable, volatile, as in ROS 2. A depth of 0, or a duration that is not
// positive, is refused when an entity is created with it (std::logic_error).
//
// What a publisher offers must be at least what a subscription asks for, else the two are not
// connected: reliable, transient local, manual liveliness are more than their counterparts, and a
// shorter deadline or lease more than a longer one or none.
class QoS {
 public:
  // NOLINTNEXTLINE(google-explicit-constructor): create_publisher<T>("topic", 10) as in rclcpp
  constexpr QoS(std::uint32_t depth) noexcept : depth_(depth) {}
  constexpr explicit QoS(KeepLast history) noexcept : depth_(history.depth) {}
  constexpr explicit QoS(KeepAll) noexcept : history_(History::keep_all) {}

  constexpr QoS& keep_last(std::uint32_t depth) noexcept {
    history_ = History::keep_last;
    depth_ = depth;
    return *this;
  }
  constexpr QoS& keep_all() noexcept {
    history_ = History::keep_all;
    depth_ = 0;
    return *this;
  }
  constexpr QoS& reliable() noexcept {
    reliability_ = Reliability::reliable;
    return *this;
  }
  constexpr QoS& best_effort() noexcept {
    reliability_ = Reliability::best_effort;
    return *this;
  }
  constexpr QoS& transient_local() noexcept {
    durability_ = Durability::transient_local;
    return *this;
  }
  constexpr QoS& durability_volatile() noexcept {
    durability_ = Durability::volatile_only;
    return *this;
  }

  // How far apart the topic's messages are at most: offered by a publisher, asked for by a
  // subscription. Each time it is longer both are told (event_callbacks.hpp). It has nothing to do
  // with the deadline of a callback's options, which bounds that callback's response time.
  constexpr QoS& deadline(std::chrono::nanoseconds period) noexcept {
    deadline_ = period;
    return *this;
  }
  // A publisher's messages are gone so long after they were published, from queues too.
  constexpr QoS& lifespan(std::chrono::nanoseconds duration) noexcept {
    lifespan_ = duration;
    return *this;
  }
  constexpr QoS& liveliness(Liveliness kind) noexcept {
    liveliness_ = kind;
    return *this;
  }
  // How long a writer that does not say that it is alive is taken to be.
  constexpr QoS& liveliness_lease_duration(std::chrono::nanoseconds duration) noexcept {
    lease_duration_ = duration;
    return *this;
  }

  // How long Publisher::publish() of a reliable publisher waits at most while readers elsewhere have
  // not acknowledged as much as the network may hold (500 kB unless DDS is configured otherwise).
  // A message that cannot be sent by then is sent to nobody. Empty: for ever.
  constexpr QoS& max_blocking_time(std::optional<std::chrono::nanoseconds> duration) noexcept {
    max_blocking_time_ = duration;
    return *this;
  }

  constexpr History history() const noexcept { return history_; }
  // 0 with keep_all.
  constexpr std::uint32_t depth() const noexcept { return depth_; }
  constexpr Reliability reliability() const noexcept { return reliability_; }
  constexpr Durability durability() const noexcept { return durability_; }
  // Empty: unlimited.
  constexpr std::optional<std::chrono::nanoseconds> deadline() const noexcept { return deadline_; }
  constexpr std::optional<std::chrono::nanoseconds> lifespan() const noexcept { return lifespan_; }
  constexpr Liveliness liveliness() const noexcept { return liveliness_; }
  constexpr std::optional<std::chrono::nanoseconds> liveliness_lease_duration() const noexcept {
    return lease_duration_;
  }
  constexpr std::optional<std::chrono::nanoseconds> max_blocking_time() const noexcept {
    return max_blocking_time_;
  }

  friend constexpr bool operator==(const QoS&, const QoS&) noexcept = default;

 private:
  History history_ = History::keep_last;
  Reliability reliability_ = Reliability::reliable;
  Durability durability_ = Durability::volatile_only;
  Liveliness liveliness_ = Liveliness::automatic;
  std::uint32_t depth_ = 0;
  std::optional<std::chrono::nanoseconds> deadline_;
  std::optional<std::chrono::nanoseconds> lifespan_;
  std::optional<std::chrono::nanoseconds> lease_duration_;
  std::optional<std::chrono::nanoseconds> max_blocking_time_ = std::chrono::milliseconds{100};
};

// The last five samples, best effort: for data that is worthless once newer data exists.
class SensorDataQoS : public QoS {
 public:
  constexpr SensorDataQoS() noexcept : QoS(KeepLast{5}) { best_effort(); }
};

// The last ten, reliable: requests and responses, as in ROS 2.
class ServicesQoS : public QoS {
 public:
  constexpr ServicesQoS() noexcept : QoS(KeepLast{10}) {}
};

}  // namespace cie
