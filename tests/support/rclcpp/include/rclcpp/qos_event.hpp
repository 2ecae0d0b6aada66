#pragma once

#include <functional>
#include <memory>
#include <stdexcept>
#include <utility>

#include <rclcpp/logging.hpp>
#include <rclcpp/waitable.hpp>
#include <rmw_double/bus.hpp>

namespace rclcpp {

struct QOSRequestedIncompatibleQoSInfo {
  int total_count = 0;
  int total_count_change = 0;
};
using QOSOfferedIncompatibleQoSInfo = QOSRequestedIncompatibleQoSInfo;
using QOSRequestedIncompatibleQoSCallbackType =
    std::function<void(QOSRequestedIncompatibleQoSInfo&)>;
using QOSMessageLostInfo = rmw_message_lost_status_t;
using QOSMessageLostCallbackType = std::function<void(QOSMessageLostInfo&)>;

class QOSEventHandlerBase : public Waitable {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(QOSEventHandlerBase)
  explicit QOSEventHandlerBase(std::shared_ptr<rmw_double::Event> event)
      : event_(std::move(event)) {}
  ~QOSEventHandlerBase() override { event_->notice.clear(); }
  void add_to_wait_set(rcl_wait_set_t*) override {}
  bool is_ready(rcl_wait_set_t*) override { return false; }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t) override { return take_data(); }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    event_->notice.set([callback = std::move(callback)](std::size_t count) { callback(count, 0); });
  }
  void clear_on_ready_callback() override { event_->notice.clear(); }

 protected:
  std::shared_ptr<rmw_double::Event> event_;
};

// The kind of function is part of the type, as in rclcpp.
template <typename Function, typename Info>
class QOSEventHandler : public QOSEventHandlerBase {
 public:
  QOSEventHandler(std::shared_ptr<rmw_double::Event> event, Function function)
      : QOSEventHandlerBase(std::move(event)), function_(std::move(function)) {}
  std::shared_ptr<void> take_data() override {
    const auto count = event_->take();
    if (!count) return nullptr;
    auto info = std::make_shared<Info>();
    info->total_count += static_cast<decltype(info->total_count)>(count->total);
    info->total_count_change += static_cast<decltype(info->total_count)>(count->change);
    return info;
  }
  void execute(std::shared_ptr<void>& data) override {
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
QOSEventHandlerBase::SharedPtr make_event_handler(const std::shared_ptr<rmw_double::Event>& event,
                                                  const EventCallbacks& callbacks, bool use_default,
                                                  const char* topic);

}  // namespace rclcpp
