#pragma once

#include <rclcpp/subscription.hpp>

namespace rclcpp {

class PublisherBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(PublisherBase)
  PublisherBase(std::string topic, const QoS& qos, const PublisherEventCallbacks& callbacks,
                bool use_process);
  PublisherBase(const PublisherBase&) = delete;
  PublisherBase& operator=(const PublisherBase&) = delete;
  virtual ~PublisherBase();
  const auto& get_event_handlers() const { return events_; }
  std::size_t get_subscription_count() const;

 protected:
  void write(std::shared_ptr<const void> message);

  const std::string topic_;
  const bool use_process_;

 private:
  const rmw_qos_profile_t qos_;
  const rmw_gid_t gid_;
  const std::shared_ptr<rmw_double::Event> incompatible_;
  std::vector<EventHandlerOfDouble::SharedPtr> events_;
};

template <typename Message>
class Publisher : public PublisherBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Publisher)
  using PublisherBase::PublisherBase;
  void publish(const Message& message) { publish(std::make_unique<Message>(message)); }
  // Through the middleware only if somebody listens there alone.
  void publish(std::unique_ptr<Message> message) {
    const std::shared_ptr<const Message> shared = std::move(message);
    if (use_process_) {
      const auto inside = rmw_double::Bus::get().process_subscriptions(topic_);
      const bool is_heard_outside = get_subscription_count() > inside.size();
      for (const auto& each : inside) {
        std::static_pointer_cast<experimental::SubscriptionIntraProcess<Message>>(each)->provide(
            std::make_shared<Message>(*shared));
      }
      if (!is_heard_outside) return;
    }
    write(shared);
  }
};

}  // namespace rclcpp
