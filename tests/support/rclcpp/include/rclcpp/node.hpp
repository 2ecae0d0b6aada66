#pragma once

#include <chrono>
#include <map>
#include <utility>

#include <rcl_interfaces/srv/set_parameters.hpp>
#include <rclcpp/executor.hpp>
#include <rclcpp/publisher.hpp>

namespace rclcpp {

class NodeOptions {
 public:
  NodeOptions& use_intra_process_comms(bool use) {
    use_intra_process_ = use;
    return *this;
  }
  NodeOptions& context(Context::SharedPtr context) {
    context_ = std::move(context);
    return *this;
  }
  bool use_intra_process_comms() const { return use_intra_process_; }
  const Context::SharedPtr& context() const { return context_; }

 private:
  bool use_intra_process_ = false;
  Context::SharedPtr context_ = contexts::get_global_default_context();
};

struct SubscriptionOptions {
  CallbackGroup::SharedPtr callback_group{};
  SubscriptionEventCallbacks event_callbacks{};
  bool use_default_callbacks = true;
};
struct PublisherOptions {
  CallbackGroup::SharedPtr callback_group{};
  PublisherEventCallbacks event_callbacks{};
};

class Parameter {
 public:
  Parameter(std::string name, std::int64_t value) : name_(std::move(name)), value_(value) {}
  const std::string& get_name() const { return name_; }
  std::int64_t as_int() const { return value_; }

 private:
  std::string name_;
  std::int64_t value_;
};

namespace node_interfaces {

class NodeWaitablesInterface {
 public:
  explicit NodeWaitablesInterface(NodeBaseInterface& base) : base_(base) {}
  void add_waitable(const Waitable::SharedPtr& waitable, const CallbackGroup::SharedPtr& group);

 private:
  NodeBaseInterface& base_;
};

}  // namespace node_interfaces

// Humble takes the middleware's own structure, Iron and later rclcpp's.
#if RCLCPP_VERSION_MAJOR < 21
using QosOfServices = rmw_qos_profile_t;
inline const QosOfServices kServicesDefault = rmw_qos_profile_services_default;
inline const rmw_qos_profile_t& profile_of(const rmw_qos_profile_t& profile) { return profile; }
#else
using QosOfServices = QoS;
inline const QosOfServices kServicesDefault = ServicesQoS{};
inline const rmw_qos_profile_t& profile_of(const QoS& qos) { return qos.get_rmw_qos_profile(); }
#endif

class Node : public std::enable_shared_from_this<Node> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Node)
  using OnSet =
      std::function<rcl_interfaces::msg::SetParametersResult(const std::vector<Parameter>&)>;

  explicit Node(const std::string& name, const NodeOptions& options = NodeOptions())
      : Node(name, "", options) {}
  Node(const std::string& name, const std::string& name_space,
       const NodeOptions& options = NodeOptions());
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  virtual ~Node() = default;

  node_interfaces::NodeBaseInterface::SharedPtr get_node_base_interface() { return base_; }
  std::shared_ptr<node_interfaces::NodeWaitablesInterface> get_node_waitables_interface() {
    return waitables_;
  }
  const char* get_fully_qualified_name() const { return base_->get_fully_qualified_name(); }
  CallbackGroup::SharedPtr create_callback_group(CallbackGroupType type,
                                                 bool automatically_add = true) {
    return base_->create_callback_group(type, automatically_add);
  }

  template <typename Message>
  std::shared_ptr<Publisher<Message>> create_publisher(
      const std::string& topic, const QoS& qos,
      const PublisherOptions& options = PublisherOptions()) {
    auto publisher = std::make_shared<Publisher<Message>>(
        base_->resolved(topic), qos, options.event_callbacks, options_.use_intra_process_comms());
    place(options.callback_group, [&](CallbackGroup& group) {
      for (const auto& event : publisher->get_event_handlers())
        group.add<Waitable>(event);
    });
    return publisher;
  }
  template <typename Message, typename Function>
  std::shared_ptr<Subscription<Message>> create_subscription(
      const std::string& topic, const QoS& qos, Function&& function,
      const SubscriptionOptions& options = SubscriptionOptions()) {
    auto subscription = std::make_shared<Subscription<Message>>(
        base_->resolved(topic), qos, std::forward<Function>(function), options.event_callbacks,
        options.use_default_callbacks, options_.use_intra_process_comms());
    place(options.callback_group, [&](CallbackGroup& group) {
      group.add<SubscriptionBase>(subscription);
      for (const auto& [type, event] : subscription->get_event_handlers())
        group.add<Waitable>(event);
      if (const auto process = subscription->get_intra_process_waitable()) group.add(process);
    });
    return subscription;
  }
  template <typename Function>
  TimerBase::SharedPtr create_wall_timer(std::chrono::nanoseconds period, Function function,
                                         const CallbackGroup::SharedPtr& group = nullptr) {
    return create_timer(std::make_shared<Clock>(RCL_STEADY_TIME), period, std::move(function),
                        group);
  }
  template <typename Function>
  TimerBase::SharedPtr create_timer(Clock::SharedPtr clock, std::chrono::nanoseconds period,
                                    Function function, const CallbackGroup::SharedPtr& group) {
    TimerBase::SharedPtr timer =
        std::make_shared<GenericTimer<Function>>(std::move(clock), period, std::move(function));
    place(group, [&](CallbackGroup& in) { in.add(timer); });
    return timer;
  }
  template <typename Type, typename Function>
  std::shared_ptr<Service<Type>> create_service(const std::string& name, Function&& function,
                                                const QosOfServices& qos = kServicesDefault,
                                                const CallbackGroup::SharedPtr& group = nullptr) {
    auto service = std::make_shared<Service<Type>>(base_->resolved(name), profile_of(qos),
                                                   std::forward<Function>(function));
    place(group, [&](CallbackGroup& in) { in.add<ServiceBase>(service); });
    return service;
  }
  template <typename Type>
  std::shared_ptr<Client<Type>> create_client(const std::string& name,
                                              const QosOfServices& qos = kServicesDefault,
                                              const CallbackGroup::SharedPtr& group = nullptr) {
    auto client = std::make_shared<Client<Type>>(base_->resolved(name), profile_of(qos));
    place(group, [&](CallbackGroup& in) { in.add<ClientBase>(client); });
    return client;
  }

  // Parameters are integers here. The function is called while the handle lives.
  [[nodiscard]] std::shared_ptr<OnSet> add_on_set_parameters_callback(OnSet function);
  rcl_interfaces::msg::SetParametersResult set_parameter(const Parameter& parameter);
  std::int64_t get_parameter(const std::string& name) const;

 private:
  // Into the group, or the default one, and tells executors.
  void place(const CallbackGroup::SharedPtr& group,
             const std::function<void(CallbackGroup&)>& function);

  const NodeOptions options_;
  const node_interfaces::NodeBaseInterface::SharedPtr base_;
  const std::shared_ptr<node_interfaces::NodeWaitablesInterface> waitables_;
  mutable std::recursive_mutex parameters_mutex_;  // of what follows
  std::map<std::string, std::int64_t> parameters_;
  std::vector<std::weak_ptr<OnSet>> on_set_;
  std::shared_ptr<Publisher<rcl_interfaces::msg::ParameterEvent>> parameter_events_;
  std::vector<std::shared_ptr<void>> own_;  // the endpoints of parameters
};

// As rclcpp's free function of that name.
template <typename Function>
TimerBase::SharedPtr create_timer(const Node::SharedPtr& node, const Clock::SharedPtr& clock,
                                  const Duration& period, Function function,
                                  const CallbackGroup::SharedPtr& group = nullptr) {
  return node->create_timer(clock, std::chrono::nanoseconds{period.nanoseconds()},
                            std::move(function), group);
}

}  // namespace rclcpp
