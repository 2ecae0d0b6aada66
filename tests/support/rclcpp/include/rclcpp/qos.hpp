#pragma once

#include <cstddef>

#include <rmw/types.h>

namespace rclcpp {

using HistoryPolicy = rmw_qos_history_policy_t;

struct KeepAll {};

class QoS {
 public:
  QoS(std::size_t depth)
      : QoS({HistoryPolicy::KeepLast, depth, rmw_qos_reliability_policy_t::Reliable}) {}
  explicit QoS(KeepAll)
      : QoS({HistoryPolicy::KeepAll, 0, rmw_qos_reliability_policy_t::Reliable}) {}
  explicit QoS(const rmw_qos_profile_t& profile) : profile_(profile) {}
  QoS& best_effort() {
    profile_.reliability = rmw_qos_reliability_policy_t::BestEffort;
    return *this;
  }
  HistoryPolicy history() const { return profile_.history; }
  std::size_t depth() const { return profile_.depth; }
  const rmw_qos_profile_t& get_rmw_qos_profile() const { return profile_; }

 private:
  rmw_qos_profile_t profile_;
};

class ServicesQoS : public QoS {
 public:
  ServicesQoS() : QoS(rmw_qos_profile_services_default) {}
};

}  // namespace rclcpp
