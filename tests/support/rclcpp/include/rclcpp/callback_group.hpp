#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include <rclcpp/client.hpp>
#include <rclcpp/guard_condition.hpp>
#include <rclcpp/service.hpp>
#include <rclcpp/subscription_base.hpp>
#include <rclcpp/timer.hpp>
#include <rclcpp/waitable.hpp>

namespace rclcpp {

enum class CallbackGroupType { MutuallyExclusive, Reentrant };

// Holds what is in it weakly, in the order of creation.
class CallbackGroup {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(CallbackGroup)
  CallbackGroup(CallbackGroupType type, Context::SharedPtr context, bool automatically_add)
      : type_(type), automatically_add_(automatically_add), context_(std::move(context)) {}
  CallbackGroup(const CallbackGroup&) = delete;
  CallbackGroup& operator=(const CallbackGroup&) = delete;
  ~CallbackGroup() { trigger_notify_guard_condition(); }

  const CallbackGroupType& type() const { return type_; }
  bool automatically_add_to_executor_with_node() const { return automatically_add_; }
  std::atomic_bool& get_associated_with_executor_atomic() { return is_associated_; }
#if RCLCPP_VERSION_MAJOR < 21
  GuardCondition::SharedPtr get_notify_guard_condition(const Context::SharedPtr& context) {
    return notify_of(context);
  }
#else
  GuardCondition::SharedPtr get_notify_guard_condition() { return notify_of(context_); }
#endif
  void trigger_notify_guard_condition();
  void collect_all_ptrs(const std::function<void(const SubscriptionBase::SharedPtr&)>& subscription,
                        const std::function<void(const ServiceBase::SharedPtr&)>& service,
                        const std::function<void(const ClientBase::SharedPtr&)>& client,
                        const std::function<void(const TimerBase::SharedPtr&)>& timer,
                        const std::function<void(const Waitable::SharedPtr&)>& waitable) const;

  template <typename Entity>
  void add(const std::shared_ptr<Entity>& entity) {
    const std::lock_guard lock{mutex_};
    auto& list = std::get<std::vector<std::weak_ptr<Entity>>>(entities_);
    std::erase_if(list, [](const auto& each) { return each.expired(); });
    list.push_back(entity);
  }

 private:
  template <typename Entity>
  using All = std::vector<std::weak_ptr<Entity>>;
  GuardCondition::SharedPtr notify_of(const Context::SharedPtr& context);

  const CallbackGroupType type_;
  const bool automatically_add_;
  const Context::SharedPtr context_;
  std::atomic_bool is_associated_{false};
  mutable std::mutex mutex_;
  std::tuple<All<SubscriptionBase>, All<ServiceBase>, All<ClientBase>, All<TimerBase>,
             All<Waitable>>
      entities_;
  std::recursive_mutex notify_mutex_;
  GuardCondition::SharedPtr notify_;
};

}  // namespace rclcpp
