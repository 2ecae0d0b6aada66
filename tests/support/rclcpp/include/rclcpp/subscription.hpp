#pragma once

#include <algorithm>
#include <cstring>
#include <deque>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>

#include <rclcpp/experimental/subscription_intra_process_base.hpp>
#include <rclcpp/subscription_base.hpp>

namespace rclcpp {

namespace experimental {

// What comes through the process, on the publisher's thread; a full queue loses its oldest.
template <typename Message>
class SubscriptionIntraProcess : public SubscriptionIntraProcessBase {
 public:
  using Function = std::function<void(std::shared_ptr<Message>)>;
  SubscriptionIntraProcess(std::size_t depth, Function function)
      : depth_(depth), function_(std::move(function)) {}
  void add_to_wait_set(ToWaitSet) override {}
  bool is_ready(OfWaitSet) override { return false; }
  void provide(std::shared_ptr<Message> message) {
    {
      const std::lock_guard lock{mutex_};
      if (messages_.size() == depth_) messages_.pop_front();
      messages_.push_back(std::move(message));
    }
    notice_.raise();
  }
  std::shared_ptr<void> take_data() override {
    const std::lock_guard lock{mutex_};
    if (messages_.empty()) return nullptr;
    auto message = std::move(messages_.front());
    messages_.pop_front();
    return message;
  }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return take_data(); }
  void execute(TakenData data) override {
    if (!data) throw std::runtime_error{"'data' is empty"};
    function_(std::static_pointer_cast<Message>(data));
  }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    notice_.set([callback = std::move(callback)](std::size_t count) { callback(count, 0); },
                depth_);
  }
  void clear_on_ready_callback() override { notice_.clear(); }

 private:
  const std::size_t depth_;
  const Function function_;
  rmw_double::Notice notice_;
  std::mutex mutex_;
  std::deque<std::shared_ptr<Message>> messages_;
};

}  // namespace experimental

template <typename Message>
class Subscription : public SubscriptionBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Subscription)
  template <typename Function>
  static constexpr bool kIsSerialized =
      std::is_invocable_v<Function, std::shared_ptr<SerializedMessage>>;

  template <typename Function>
  Subscription(const std::string& topic, const QoS& qos, Function function,
               const SubscriptionEventCallbacks& callbacks, bool use_default_callbacks,
               bool use_process)
      : SubscriptionBase(topic, qos, callbacks, use_default_callbacks, kIsSerialized<Function>) {
    if constexpr (kIsSerialized<Function>) {
      serialized_ = std::move(function);
    } else if constexpr (std::is_invocable_v<Function, std::shared_ptr<Message>>) {
      function_ = std::move(function);
    } else if constexpr (std::is_invocable_v<Function, std::unique_ptr<Message>>) {
      function_ = [function](const std::shared_ptr<Message>& message) {
        function(std::make_unique<Message>(*message));
      };
    } else {
      function_ = [function](const std::shared_ptr<Message>& message) { function(*message); };
    }
    if (!use_process) return;
    process_ =
        std::make_shared<experimental::SubscriptionIntraProcess<Message>>(qos.depth(), function_);
    rmw_double::Bus::get().join_process(topic, process_);
  }

  std::shared_ptr<void> create_message() override { return std::make_shared<Message>(); }
  void handle_message(std::shared_ptr<void>& message, const MessageInfo& info) override {
    if (matches_any_intra_process_publishers(&info.get_rmw_message_info().publisher_gid)) return;
    function_(std::static_pointer_cast<Message>(message));
  }
  void handle_loaned_message(void* loaned, const MessageInfo& info) override {
    if (matches_any_intra_process_publishers(&info.get_rmw_message_info().publisher_gid)) return;
    function_(std::shared_ptr<Message>{static_cast<Message*>(loaned), [](Message*) {}});
  }
  void handle_serialized_message(const std::shared_ptr<SerializedMessage>& message,
                                 const MessageInfo&) override {
    serialized_(message);
  }

 private:
  void copy(const void* from, void* to) const override {
    *static_cast<Message*>(to) = *static_cast<const Message*>(from);
  }
  void serialize(const void* from, SerializedMessage& to) const override {
    if constexpr (std::is_trivially_copyable_v<Message>) {
      to.bytes.resize(sizeof(Message));
      std::memcpy(to.bytes.data(), from, sizeof(Message));
    }
  }
  std::function<void(std::shared_ptr<Message>)> function_;
  std::function<void(std::shared_ptr<SerializedMessage>)> serialized_;
};

}  // namespace rclcpp
