#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <vector>

#include <rclcpp/callback_group.hpp>
#include <rclcpp/context.hpp>
#include <rclcpp/guard_condition.hpp>
#include <rclcpp/node_interfaces/node_base_interface.hpp>

namespace rclcpp {

class Node;

struct ExecutorOptions {
  Context::SharedPtr context = contexts::get_global_default_context();
};

class Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Executor)
  explicit Executor(const ExecutorOptions& options = ExecutorOptions());
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  virtual ~Executor();

  virtual void spin() = 0;
  virtual void add_callback_group(CallbackGroup::SharedPtr group,
                                  node_interfaces::NodeBaseInterface::SharedPtr node,
                                  bool notify = true) = 0;
  virtual std::vector<CallbackGroup::WeakPtr> get_all_callback_groups() = 0;
  virtual std::vector<CallbackGroup::WeakPtr> get_manually_added_callback_groups() = 0;
  virtual std::vector<CallbackGroup::WeakPtr>
  get_automatically_added_callback_groups_from_nodes() = 0;
  virtual void remove_callback_group(CallbackGroup::SharedPtr group, bool notify = true) = 0;
  virtual void add_node(node_interfaces::NodeBaseInterface::SharedPtr node, bool notify = true) = 0;
  virtual void add_node(std::shared_ptr<Node> node, bool notify = true) = 0;
  virtual void remove_node(node_interfaces::NodeBaseInterface::SharedPtr node,
                           bool notify = true) = 0;
  virtual void remove_node(std::shared_ptr<Node> node, bool notify = true) = 0;
  virtual void spin_some(std::chrono::nanoseconds max_duration = std::chrono::nanoseconds{0}) = 0;
  virtual void spin_all(std::chrono::nanoseconds max_duration) = 0;
  virtual void spin_once(std::chrono::nanoseconds timeout = std::chrono::nanoseconds{-1}) = 0;
  void spin_until_future_complete() { spin_once_impl(std::chrono::nanoseconds{-1}); }
  void cancel();

 protected:
  virtual void spin_once_impl(std::chrono::nanoseconds timeout) = 0;

  std::atomic_bool spinning{false};
  GuardCondition interrupt_guard_condition_;
  std::shared_ptr<GuardCondition> shutdown_guard_condition_;
  Context::SharedPtr context_;

 private:
  OnShutdownCallbackHandle shutdown_callback_handle_;
};

}  // namespace rclcpp
