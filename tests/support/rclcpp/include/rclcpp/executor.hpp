#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <vector>

#include <rclcpp/callback_group.hpp>
#include <rclcpp/context.hpp>
#include <rclcpp/future_return_code.hpp>
#include <rclcpp/guard_condition.hpp>
#include <rclcpp/node_interfaces/node_base_interface.hpp>
#include <rclcpp/version.h>

namespace rclcpp {

class Node;

struct ExecutorOptions {
  Context::SharedPtr context = contexts::get_global_default_context();
};

class Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Executor)
#if RCLCPP_VERSION_MAJOR < 31
  using GroupArgument = CallbackGroup::SharedPtr;
  using NodeBaseArgument = node_interfaces::NodeBaseInterface::SharedPtr;
  using NodeArgument = std::shared_ptr<Node>;
#else
  using GroupArgument = const CallbackGroup::SharedPtr&;
  using NodeBaseArgument = const node_interfaces::NodeBaseInterface::SharedPtr&;
  using NodeArgument = const std::shared_ptr<Node>&;
#endif
  explicit Executor(const ExecutorOptions& options = ExecutorOptions());
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  virtual ~Executor();

  virtual void spin() = 0;
  virtual void add_callback_group(GroupArgument group, NodeBaseArgument node,
                                  bool notify = true) = 0;
  virtual std::vector<CallbackGroup::WeakPtr> get_all_callback_groups() = 0;
  virtual std::vector<CallbackGroup::WeakPtr> get_manually_added_callback_groups() = 0;
  virtual std::vector<CallbackGroup::WeakPtr>
  get_automatically_added_callback_groups_from_nodes() = 0;
  virtual void remove_callback_group(GroupArgument group, bool notify = true) = 0;
  virtual void add_node(NodeBaseArgument node, bool notify = true) = 0;
  virtual void add_node(NodeArgument node, bool notify = true) = 0;
  virtual void remove_node(NodeBaseArgument node, bool notify = true) = 0;
  virtual void remove_node(NodeArgument node, bool notify = true) = 0;
  virtual void spin_some(std::chrono::nanoseconds max_duration = std::chrono::nanoseconds{0}) = 0;
  virtual void spin_all(std::chrono::nanoseconds max_duration) = 0;
  virtual void spin_once(std::chrono::nanoseconds timeout = std::chrono::nanoseconds{-1}) = 0;
  template <typename Future>
  FutureReturnCode spin_until_future_complete(
      const Future& future, std::chrono::nanoseconds timeout = std::chrono::nanoseconds{-1}) {
    return spin_until_future_complete_impl(
        timeout, [&future](std::chrono::nanoseconds time) { return future.wait_for(time); });
  }
#if RCLCPP_VERSION_MAJOR < 28
  void cancel();
#else
  virtual void cancel();
#endif
  bool is_spinning() { return spinning; }

 protected:
  using WaitForFuture = std::function<std::future_status(std::chrono::nanoseconds)>;
#if RCLCPP_VERSION_MAJOR >= 28
  virtual
#endif
      FutureReturnCode
      spin_until_future_complete_impl(std::chrono::nanoseconds timeout,
                                      const WaitForFuture& wait_for_future);
  virtual void spin_once_impl(std::chrono::nanoseconds timeout) = 0;

  std::atomic_bool spinning{false};
#if RCLCPP_VERSION_MAJOR < 21
  GuardCondition interrupt_guard_condition_;
#else
  std::shared_ptr<GuardCondition> interrupt_guard_condition_;
#endif
  std::shared_ptr<GuardCondition> shutdown_guard_condition_;
  Context::SharedPtr context_;

 private:
  OnShutdownCallbackHandle shutdown_callback_handle_;
};

}  // namespace rclcpp
