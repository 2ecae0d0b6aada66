// Where rclcpp's distributions differ, Humble to Lyrical: each difference once, told apart by what the
// headers offer rather than by version numbers.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include <rclcpp/callback_group.hpp>
#include <rclcpp/executor.hpp>
#include <rclcpp/guard_condition.hpp>
#include <rclcpp/subscription_base.hpp>
#include <rclcpp/timer.hpp>
#include <rclcpp/version.h>
#include <rclcpp/waitable.hpp>
#if __has_include(<rclcpp/event_handler.hpp>)  // Iron and later
#include <rclcpp/event_handler.hpp>
#else
#include <rclcpp/qos_event.hpp>
#endif

namespace cie_rclcpp {

#if __has_include(<rclcpp/event_handler.hpp>)
using QosEventHandler = rclcpp::EventHandlerBase;
inline constexpr bool kOwnHandlersAreFunctions = true;
// Whether a waitable's notice is whole from the first on. In Humble, set_on_ready_callback() gives the
// middleware a lambda where it expects a std::function, for as long as it takes to put the function
// beside it: called meanwhile, or at once for what came before, a notice has its count and no number.
inline constexpr bool kNoticesAreWhole = true;
#else
using QosEventHandler = rclcpp::QOSEventHandlerBase;
inline constexpr bool kOwnHandlersAreFunctions = false;
inline constexpr bool kNoticesAreWhole = false;
#endif

// A subscription lists its handlers, since Iron by event.
inline const QosEventHandler& event_handler(const std::shared_ptr<QosEventHandler>& handler) {
  return *handler;
}
template <typename Event>
const QosEventHandler& event_handler(
    const std::pair<const Event, std::shared_ptr<QosEventHandler>>& handler) {
  return *handler.second;
}

// Takes the expiry off rcl's timer and runs the user's function between `begin` and the return. Since
// Jazzy call() brings data for it. False if the timer was cancelled meanwhile.
template <typename Timer, typename Begin>
bool call_timer(Timer& timer, Begin begin) {
  const auto called = timer.call();
  if (!called) return false;
  begin();
  if constexpr (requires { timer.execute_callback(called); }) {
    timer.execute_callback(called);
  } else {
    timer.execute_callback();
  }
  return true;
}

// Whether reset() tells us (Iron and later); before, a timer that was cancelled is looked at once a
// period.
template <typename Timer>
bool tell_of_reset(Timer& timer, std::function<void(std::size_t)> told) {
  if constexpr (requires { timer.set_on_reset_callback(told); }) {
    timer.set_on_reset_callback(std::move(told));
    return true;
  }
  return false;
}
template <typename Timer>
void end_telling_of_reset(Timer& timer) {
  if constexpr (requires { timer.clear_on_reset_callback(); }) timer.clear_on_reset_callback();
}

// Since Jazzy it takes a const reference.
template <typename Waitable>
void execute_waitable(Waitable& waitable, std::shared_ptr<void>& data) {
  if constexpr (requires(const std::shared_ptr<void>& constant) { waitable.execute(constant); }) {
    waitable.execute(std::as_const(data));
  } else {
    waitable.execute(data);
  }
}

enum class MessageForm : std::uint8_t { typed, serialized };

// Since Iron messages may also be of a type known at run time only, which rclcpp's own executors
// refuse too.
template <typename Subscription>
MessageForm form_of(const Subscription& subscription) {
  if constexpr (requires { subscription.get_delivered_message_kind(); }) {
    switch (subscription.get_delivered_message_kind()) {
      case decltype(subscription.get_delivered_message_kind())::SERIALIZED_MESSAGE:
        return MessageForm::serialized;
      case decltype(subscription.get_delivered_message_kind())::ROS_MESSAGE:
        return MessageForm::typed;
      default:
        throw std::runtime_error{"a subscription to messages of dynamic type cannot be served"};
    }
  } else {
    return subscription.is_serialized() ? MessageForm::serialized : MessageForm::typed;
  }
}

// A group's own guard condition, which is told of what is created in it; null before the context is
// there. Since Iron a group knows its context.
template <typename Group>
std::shared_ptr<rclcpp::GuardCondition> notice_of(Group& group,
                                                  const rclcpp::Context::SharedPtr& context) {
  if constexpr (requires { group.get_notify_guard_condition(); }) {
    return group.get_notify_guard_condition();
  } else {
    return group.get_notify_guard_condition(context);
  }
}

// The node's guard condition, which is told of its new groups and callbacks; the node keeps it. Null where
// the node is going. Until Jazzy, a reference.
template <typename NodeBase>
rclcpp::GuardCondition* notice_of_node(NodeBase& node) {
  if constexpr (requires { node.get_shared_notify_guard_condition(); }) {
    return node.get_shared_notify_guard_condition().get();
  } else {
    return &node.get_notify_guard_condition();
  }
}

// The executor's interrupt, a member in Humble and a shared one since Iron.
inline rclcpp::GuardCondition& condition(rclcpp::GuardCondition& own) { return own; }
inline rclcpp::GuardCondition& condition(const std::shared_ptr<rclcpp::GuardCondition>& shared) {
  return *shared;
}

}  // namespace cie_rclcpp
