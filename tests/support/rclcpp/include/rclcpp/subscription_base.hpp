#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include <rcl/event.h>
#include <rcl/subscription.h>
#include <rclcpp/context.hpp>
#include <rclcpp/double_callback.hpp>
#include <rclcpp/double_events.hpp>
#include <rclcpp/message_info.hpp>
#include <rclcpp/qos.hpp>
#include <rclcpp/waitable.hpp>

namespace rclcpp {

class SerializedMessage {
 public:
  std::vector<std::byte> bytes{};
};

enum class DeliveredMessageKind { INVALID, ROS_MESSAGE, SERIALIZED_MESSAGE, DYNAMIC_MESSAGE };

class SubscriptionBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(SubscriptionBase)
  SubscriptionBase(std::string topic, const QoS& qos, const SubscriptionEventCallbacks& callbacks,
                   bool use_default_callbacks, bool is_serialized);
  SubscriptionBase(const SubscriptionBase&) = delete;
  SubscriptionBase& operator=(const SubscriptionBase&) = delete;
  virtual ~SubscriptionBase();

  const char* get_topic_name() const { return topic_.c_str(); }
  QoS get_actual_qos() const { return QoS{reader().qos()}; }
  bool is_serialized() const { return is_serialized_; }
#if RCLCPP_VERSION_MAJOR >= 21
  DeliveredMessageKind get_delivered_message_kind() const {
    return is_serialized_ ? DeliveredMessageKind::SERIALIZED_MESSAGE
                          : DeliveredMessageKind::ROS_MESSAGE;
  }
#endif
  bool can_loan_messages() const { return rmw_double::are_loaned(); }
  std::shared_ptr<rcl_subscription_t> get_subscription_handle() { return handle_; }
  Waitable::SharedPtr get_intra_process_waitable() const { return process_; }
  const auto& get_event_handlers() const { return events_; }

  virtual std::shared_ptr<void> create_message() = 0;
  virtual void return_message(std::shared_ptr<void>& message) { message.reset(); }
  virtual void handle_message(std::shared_ptr<void>& message, const MessageInfo& info) = 0;
  virtual void handle_loaned_message(void* loaned, const MessageInfo& info) = 0;
  virtual std::shared_ptr<SerializedMessage> create_serialized_message();
  virtual void return_serialized_message(std::shared_ptr<SerializedMessage>& message) {
    message.reset();
  }
  virtual void handle_serialized_message(const std::shared_ptr<SerializedMessage>& message,
                                         const MessageInfo& info) = 0;
  // False: there is none.
  bool take_type_erased(void* message, MessageInfo& info);
  bool take_serialized(SerializedMessage& message, MessageInfo& info);

  void set_on_new_message_callback(const std::function<void(std::size_t)>& callback) {
    on_new_message_.set(reader(), callback);
  }
  void clear_on_new_message_callback() { on_new_message_.clear(reader()); }

 protected:
  bool matches_any_intra_process_publishers(const rmw_gid_t* sender) const;
  virtual void copy(const void* from, void* to) const = 0;
  virtual void serialize(const void* from, SerializedMessage& to) const = 0;

  rmw_double::Reader& reader() const { return *handle_->reader; }
  Waitable::SharedPtr process_;  // of a subscription that hears through the process, too

 private:
  const std::string topic_;
  const bool is_serialized_;
  OnNewCallback on_new_message_;  // goes after its owner's hold on the handle, whoever else has one
  const std::shared_ptr<rcl_subscription_t> handle_;
  std::unordered_map<rcl_subscription_event_type_t, EventHandlerOfDouble::SharedPtr> events_;
};

}  // namespace rclcpp
