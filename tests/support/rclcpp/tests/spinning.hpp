// A context of its own for each test, and an executor that spins beside it.
#pragma once

#include "admission.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/u_int32.hpp>
#include <std_srvs/srv/set_bool.hpp>

namespace cie_rclcpp::test {

using namespace std::chrono_literals;
using Message = std_msgs::msg::UInt32;
using SetBool = std_srvs::srv::SetBool;
using rclcpp::CallbackGroupType;

// For what must come, however slow the machine is.
inline bool comes(const std::function<bool()>& condition) {
  for (int i = 0; i < 20000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(1ms);
  }
  return false;
}

// For what must end, though it may have begun once more.
inline bool ends(const std::atomic<int>& runs) {
  for (int i = 0; i < 200; ++i) {
    const int until_now = runs;
    std::this_thread::sleep_for(20ms);
    if (runs == until_now) return true;
  }
  return false;
}

inline std::string name_of_this_thread() {
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return name.data();
}

inline std::shared_ptr<Admission> open_admission() {
  auto admission = std::make_shared<Admission>();
  admission->open([] { return false; });
  return admission;
}

class WithContext : public testing::Test {
 protected:
  WithContext() { context_->init(0, nullptr); }
  ~WithContext() override { context_->shutdown("end of the test"); }
  rclcpp::NodeOptions options() const { return rclcpp::NodeOptions{}.context(context_); }
  rclcpp::Node::SharedPtr node(const std::string& name) const {
    return std::make_shared<rclcpp::Node>(name, "/test", options());
  }
  rclcpp::ExecutorOptions in_context() const {
    rclcpp::ExecutorOptions in;
    in.context = context_;
    return in;
  }
  static rclcpp::SubscriptionOptions in(const rclcpp::CallbackGroup::SharedPtr& group) {
    rclcpp::SubscriptionOptions options;
    options.callback_group = group;
    return options;
  }

  const rclcpp::Context::SharedPtr context_ = std::make_shared<rclcpp::Context>();
};

// spin() on a thread, until the end of the scope.
class Spinning {
 public:
  explicit Spinning(CallbackIsolatedExecutor& executor)
      : executor_(executor), thread_([this] {
          try {
            executor_.spin();
          } catch (...) {
            failure_ = std::current_exception();
          }
          has_returned_ = true;
        }) {}
  ~Spinning() {
    if (!thread_.joinable()) return;
    executor_.cancel();
    thread_.join();
  }
  Spinning(const Spinning&) = delete;
  Spinning& operator=(const Spinning&) = delete;
  bool has_returned() const { return has_returned_; }
  // Waits for spin(), and throws what it threw.
  void join() {
    thread_.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  CallbackIsolatedExecutor& executor_;
  std::exception_ptr failure_;
  std::atomic<bool> has_returned_{false};
  std::thread thread_;
};

}  // namespace cie_rclcpp::test
