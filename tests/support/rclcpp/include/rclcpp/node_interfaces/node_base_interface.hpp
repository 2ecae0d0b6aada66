#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <rclcpp/callback_group.hpp>
#include <rclcpp/context.hpp>
#include <rclcpp/guard_condition.hpp>

namespace rclcpp::node_interfaces {

class NodeBaseInterface {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(NodeBaseInterface)
  NodeBaseInterface(const std::string& name, const std::string& name_space,
                    Context::SharedPtr context);
  const char* get_name() const { return name_.c_str(); }
  const char* get_fully_qualified_name() const { return full_name_.c_str(); }
  Context::SharedPtr get_context() { return context_; }
  std::atomic_bool& get_associated_with_executor_atomic() { return is_associated_; }
#if RCLCPP_VERSION_MAJOR < 21
  GuardCondition& get_notify_guard_condition() { return *notify_; }
#else
  GuardCondition::SharedPtr get_shared_notify_guard_condition() { return notify_; }
#endif
  void trigger_notify_guard_condition() { notify_->trigger(); }
  CallbackGroup::SharedPtr get_default_callback_group() { return default_group_; }
  CallbackGroup::SharedPtr create_callback_group(CallbackGroupType type, bool automatically_add);
  bool callback_group_in_node(const CallbackGroup::SharedPtr& group);
  void for_each_callback_group(const std::function<void(CallbackGroup::SharedPtr)>& function);
  // "x" in the node's namespace, "~/x" in that of its name, "/x" as it stands.
  std::string resolved(const std::string& name) const;

 private:
  const std::string name_;
  const std::string namespace_;  // ends in a slash
  const std::string full_name_;
  const Context::SharedPtr context_;
  std::atomic_bool is_associated_{false};
  const GuardCondition::SharedPtr notify_;
  std::mutex mutex_;  // of what follows
  std::vector<CallbackGroup::WeakPtr> groups_;
  CallbackGroup::SharedPtr default_group_;
};

}  // namespace rclcpp::node_interfaces
