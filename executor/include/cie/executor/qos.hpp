// Quality of service of a publisher or subscription, under the names a ROS 2 user knows.
#pragma once

#include <cstdint>

namespace cie {

enum class Reliability : std::uint8_t { reliable, best_effort };
enum class Durability : std::uint8_t { volatile_only, transient_local };
enum class History : std::uint8_t { keep_last, keep_all };

struct KeepLast {
  std::uint32_t depth;
};
struct KeepAll {};

// A value; the default is reliable, volatile, as in ROS 2. A depth of 0 is refused when an entity
// is created with it (std::logic_error).
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

  constexpr History history() const noexcept { return history_; }
  // 0 with keep_all.
  constexpr std::uint32_t depth() const noexcept { return depth_; }
  constexpr Reliability reliability() const noexcept { return reliability_; }
  constexpr Durability durability() const noexcept { return durability_; }

  friend constexpr bool operator==(const QoS&, const QoS&) noexcept = default;

 private:
  History history_ = History::keep_last;
  Reliability reliability_ = Reliability::reliable;
  Durability durability_ = Durability::volatile_only;
  std::uint32_t depth_ = 0;
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
