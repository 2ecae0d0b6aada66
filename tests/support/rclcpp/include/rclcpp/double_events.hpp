// Handlers of events, in Humble QOSEventHandler and since Iron EventHandler.
#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include <rclcpp/logging.hpp>
#include <rclcpp/version.h>
#include <rclcpp/waitable.hpp>
#include <rmw_double/bus.hpp>

#if RCLCPP_VERSION_MAJOR < 21
#define RCLCPP_DOUBLE_EVENT_HANDLER(suffix) QOSEventHandler##suffix
#else
#define RCLCPP_DOUBLE_EVENT_HANDLER(suffix) EventHandler##suffix
#endif

namespace rclcpp {

// Which event it is shows in the handler's type.
struct rmw_requested_qos_incompatible_event_status_t {
  int total_count = 0;
  int total_count_change = 0;
};
using QOSRequestedIncompatibleQoSInfo = rmw_requested_qos_incompatible_event_status_t;
using QOSOfferedIncompatibleQoSInfo = QOSRequestedIncompatibleQoSInfo;
using QOSRequestedIncompatibleQoSCallbackType =
    std::function<void(QOSRequestedIncompatibleQoSInfo&)>;
using QOSMessageLostInfo = rmw_message_lost_status_t;
using QOSMessageLostCallbackType = std::function<void(QOSMessageLostInfo&)>;

class RCLCPP_DOUBLE_EVENT_HANDLER(Base) : public Waitable {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(RCLCPP_DOUBLE_EVENT_HANDLER(Base))
  // `parent`: rcl's handle of whose events these are, which lives as long as the handler.
  RCLCPP_DOUBLE_EVENT_HANDLER(Base)
  (std::shared_ptr<rmw_double::Event> event, std::shared_ptr<const void> parent)
      : event_(std::move(event)), parent_(std::move(parent)) {}
  ~RCLCPP_DOUBLE_EVENT_HANDLER(Base)() override { event_->notice.clear(); }
  void add_to_wait_set(ToWaitSet) override {}
  bool is_ready(OfWaitSet) override { return false; }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return take_data(); }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    event_->notice.set([callback = std::move(callback)](std::size_t count) { callback(count, 0); });
  }
  void clear_on_ready_callback() override { event_->notice.clear(); }

 protected:
  std::shared_ptr<rmw_double::Event> event_;

 private:
  const std::shared_ptr<const void> parent_;
};
using EventHandlerOfDouble = RCLCPP_DOUBLE_EVENT_HANDLER(Base);

// The kind of function is part of the type, as in rclcpp.
template <typename Function, typename Info>
class RCLCPP_DOUBLE_EVENT_HANDLER() : public EventHandlerOfDouble {
 public:
  RCLCPP_DOUBLE_EVENT_HANDLER()
  (std::shared_ptr<rmw_double::Event> event, Function function,
   std::shared_ptr<const void> parent = nullptr)
      : EventHandlerOfDouble(std::move(event), std::move(parent)), function_(std::move(function)) {}
  std::shared_ptr<void> take_data() override {
    const auto count = event_->take();
    if (!count) return nullptr;
    auto info = std::make_shared<Info>();
    info->total_count += static_cast<decltype(info->total_count)>(count->total);
    info->total_count_change += static_cast<decltype(info->total_count)>(count->change);
    return info;
  }
  void execute(TakenData data) override {
    if (!data) throw std::runtime_error{"'data' is empty"};
    function_(*std::static_pointer_cast<Info>(data));
  }

 private:
  Function function_;
};

// Of subscriptions and publishers.
struct EventCallbacks {
  QOSRequestedIncompatibleQoSCallbackType incompatible_qos_callback{};
  QOSMessageLostCallbackType message_lost_callback{};
};
using SubscriptionEventCallbacks = EventCallbacks;
using PublisherEventCallbacks = EventCallbacks;

// Of incompatible QoS, with the user's function; else with one of rclcpp's own, which warns, or null if
// none is wanted.
EventHandlerOfDouble::SharedPtr make_event_handler(const std::shared_ptr<rmw_double::Event>& event,
                                                   const EventCallbacks& callbacks,
                                                   bool use_default, const char* topic,
                                                   std::shared_ptr<const void> parent);

}  // namespace rclcpp
