// A named set of callbacks and publishers.
#pragma once

#include <cie/executor/callback_group.hpp>
#include <cie/executor/client.hpp>
#include <cie/executor/context.hpp>
#include <cie/executor/event_callbacks.hpp>
#include <cie/executor/guard_condition.hpp>
#include <cie/executor/member_order.hpp>
#include <cie/executor/message.hpp>
#include <cie/executor/parameters.hpp>
#include <cie/executor/publisher.hpp>
#include <cie/executor/qos.hpp>
#include <cie/executor/service.hpp>
#include <cie/executor/subscription.hpp>
#include <cie/executor/timer.hpp>
#include <cie/tracepoints/schema.hpp>

#include <chrono>
#include <concepts>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <typeinfo>
#include <utility>
#include <variant>
#include <vector>

namespace cie {

class ComponentOptions;

// Topics and services under another name: what the node's code says, and what is meant. Both are
// names as the node would write them ("scan", "/scan", "~/scan").
using Remaps = std::map<std::string, std::string, std::less<>>;

namespace executor {
class NodeState;
std::shared_ptr<TimerCallback> create_timer(NodeState& node, std::chrono::nanoseconds period,
                                            std::function<void()> function,
                                            const TimerOptions& options,
                                            const std::type_info& symbol);
std::shared_ptr<TimerCallback> create_one_shot_timer(NodeState& node,
                                                     std::chrono::nanoseconds delay,
                                                     std::function<void()> function,
                                                     const TimerOptions& options,
                                                     const std::type_info& symbol);
std::shared_ptr<GuardConditionCallback> create_guard_condition(NodeState& node,
                                                               std::string_view name,
                                                               std::function<void()> function,
                                                               const CallbackOptions& options,
                                                               const std::type_info& symbol);
std::shared_ptr<SubscriptionCallback> create_subscription(
    NodeState& node, std::string_view topic, const QoS& qos, const dds_topic_descriptor& type,
    MessageFunction function, const SubscriptionOptions& options, const std::type_info& symbol);
// `code` lies in the component that publishes: it stays loaded while others have messages of it.
std::shared_ptr<Writer> create_writer(NodeState& node, std::string_view topic, const QoS& qos,
                                      const dds_topic_descriptor& type,
                                      const PublisherOptions& options, void (*code)() noexcept);
std::shared_ptr<ServiceCallback> create_service(
    NodeState& node, std::string_view service, const QoS& qos,
    const dds_topic_descriptor& request_type, const dds_topic_descriptor& response_type,
    ErasedServiceFunction function, const CallbackOptions& options, const std::type_info& symbol);
std::shared_ptr<ClientCallback> create_client(NodeState& node, std::string_view service,
                                              const QoS& qos,
                                              const dds_topic_descriptor& request_type,
                                              const dds_topic_descriptor& response_type,
                                              const ClientOptions& options,
                                              const std::type_info& symbol);
}  // namespace executor

// Entities may be created at any time from any thread, also while an executor spins the node: they
// are served from then on, until the last copy of the handle goes, or the node: that ends the
// callback. What runs then is waited for; only an instance that ends its own callback (or its node)
// returns first, and so does one of two that end each other's. Then the function is destroyed and
// callback_fini emitted. Handles, nodes, context and executor may go in whatever order, also while
// everything spins. Whatever else a callback uses must outlive it: in a class, declare such members
// above the node or above the handle (docs/nodes.md, "Lifetimes").
//
// Names are those of ROS 2: letters, digits and underscores, not starting with a digit; topics may
// be relative to the namespace ("scan"), absolute ("/scan") or private ("~/scan"). A name that does
// not fit throws std::invalid_argument.
class Node final {
 public:
  Node(const Context& context, std::string_view name, std::string_view name_space = "/",
       const Remaps& remaps = {}, const ParameterOverrides& parameters = {});
  // As the application's file says (component.hpp).
  explicit Node(const ComponentOptions& options);
  ~Node();
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  // "/ns/name".
  const std::string& fully_qualified_name() const noexcept;

  [[nodiscard]] std::shared_ptr<CallbackGroup> create_callback_group(GroupType type);

  // `period` at least 1 us, else std::invalid_argument.
  template <std::invocable F>
  [[nodiscard]] std::shared_ptr<Timer> create_wall_timer(std::chrono::nanoseconds period,
                                                         F function,
                                                         const TimerOptions& options = {}) {
    return std::make_shared<Timer>(
        executor::create_timer(*state_, period, std::move(function), options, typeid(F)));
  }

  // Expires once, `delay` (at least 1 us) after an executor first serves it, or as `options` say;
  // and again after each reset(). In traces it has no period; its logical id names the delay.
  template <std::invocable F>
  [[nodiscard]] std::shared_ptr<Timer> create_one_shot_timer(std::chrono::nanoseconds delay,
                                                             F function,
                                                             const TimerOptions& options = {}) {
    return std::make_shared<Timer>(
        executor::create_one_shot_timer(*state_, delay, std::move(function), options, typeid(F)));
  }

  // `name` is what a topic's name may be; it stands in the logical id's parentheses as it is given.
  template <std::invocable F>
  [[nodiscard]] std::shared_ptr<GuardCondition> create_guard_condition(
      std::string_view name, F function, const CallbackOptions& options = {}) {
    return std::make_shared<GuardCondition>(
        executor::create_guard_condition(*state_, name, std::move(function), options, typeid(F)));
  }

  template <Message T>
  [[nodiscard]] std::shared_ptr<Publisher<T>> create_publisher(
      std::string_view topic, const QoS& qos, const PublisherOptions& options = {}) {
    return std::make_shared<Publisher<T>>(
        executor::create_writer(*state_, topic, qos, MessageTraits<T>::descriptor(), options,
                                &executor::code_of_publisher<T>));
  }

  template <Message T, SubscriptionFunction<T> F>
  [[nodiscard]] std::shared_ptr<Subscription<T>> create_subscription(
      std::string_view topic, const QoS& qos, F function, const SubscriptionOptions& options) {
    return std::make_shared<Subscription<T>>(executor::create_subscription(
        *state_, topic, qos, MessageTraits<T>::descriptor(),
        executor::erase_message_type<T>(std::move(function)), options, typeid(F)));
  }

  template <Message T, SubscriptionFunction<T> F>
  [[nodiscard]] std::shared_ptr<Subscription<T>> create_subscription(
      std::string_view topic, const QoS& qos, F function, const CallbackOptions& options = {}) {
    return create_subscription<T>(topic, qos, std::move(function),
                                  SubscriptionOptions{options, {}});
  }

  // Services are named like topics. Requests and responses are reliable; each side keeps the last
  // 10 that wait, as in ROS 2, unless `qos` says otherwise.
  template <ServiceMessage Request, ServiceMessage Response, ServiceFunction<Request, Response> F>
  [[nodiscard]] std::shared_ptr<Service<Request, Response>> create_service(
      std::string_view service, F function, const CallbackOptions& options = {},
      const QoS& qos = ServicesQoS{}) {
    return std::make_shared<Service<Request, Response>>(executor::create_service(
        *state_, service, qos, MessageTraits<Request>::descriptor(),
        MessageTraits<Response>::descriptor(),
        [function = std::move(function)](const void* request, void* response) mutable {
          function(*static_cast<const Request*>(request), *static_cast<Response*>(response));
        },
        options, typeid(F)));
  }

  template <ServiceMessage Request, ServiceMessage Response>
  [[nodiscard]] std::shared_ptr<Client<Request, Response>> create_client(
      std::string_view service, const ClientOptions& options = {}, const QoS& qos = ServicesQoS{}) {
    return std::make_shared<Client<Request, Response>>(executor::create_client(
        *state_, service, qos, MessageTraits<Request>::descriptor(),
        MessageTraits<Response>::descriptor(), options, typeid(Client<Request, Response>)));
  }

  // Ends a callback although handles to it remain; these are idle then. Its endpoints leave the
  // network with the last of them. Throws std::logic_error if it is another node's.
  template <typename Handle>
  void remove(const std::shared_ptr<Handle>& handle) {
    handle->remove_from(*state_);
  }

  // --- parameters: from any thread ---
  // Declares a parameter and returns its value: that of the application's file or the command line,
  // else `value`. From the first one on, the node answers the parameter services of ROS 2, on the
  // thread "cie-parameters" of the process, and tells changes on /parameter_events. Throws
  // ParameterError (declared twice, no value that fits), SchedulingRefused as creating a callback
  // does, std::logic_error in an on-set callback.
  ParameterValue declare_parameter(std::string_view name, ParameterValue value,
                                   ParameterDescriptor descriptor = {});
  template <ParameterType T>
  T declare_parameter(std::string_view name, const std::type_identity_t<T>& value,
                      ParameterDescriptor descriptor = {}) {
    return std::get<T>(declare_parameter(name, ParameterValue{value}, std::move(descriptor)));
  }
  // Throws ParameterError for one that is not declared, or is read-only.
  void undeclare_parameter(std::string_view name);
  bool has_parameter(std::string_view name) const;

  // Throw ParameterError for one that is not declared, or is no T.
  ParameterValue get_parameter(std::string_view name) const;
  template <ParameterType T>
  T get_parameter(std::string_view name) const {
    ParameterValue value = get_parameter(name);
    if (T* const typed = std::get_if<T>(&value)) return std::move(*typed);
    throw ParameterError{"parameter \"" + std::string{name} + "\" is of type " +
                         std::string{kind_name(kind_of(value))}};
  }
  ParameterDescriptor describe_parameter(std::string_view name) const;

  // What is not declared, read-only, of another type, out of range, or refused by a callback is not
  // set, and the result says so. Each for itself, or all or none. Throw std::logic_error in an
  // on-set callback, and what callbacks throw.
  SetParametersResult set_parameter(std::string_view name, ParameterValue value);
  std::vector<SetParametersResult> set_parameters(const std::vector<Parameter>& parameters);
  SetParametersResult set_parameters_atomically(const std::vector<Parameter>& parameters);

  // Names, ascending, that are one of the prefixes (none: all) or begin with it and a dot, with
  // less than `depth` dots behind it (0: any number).
  std::vector<std::string> list_parameters(const std::vector<std::string>& prefixes = {},
                                           std::uint64_t depth = 0) const;

  // In service until the handle goes, which waits while another thread runs the function.
  [[nodiscard]] std::shared_ptr<void> add_on_set_parameters_callback(OnSetParameters function);
  [[nodiscard]] std::shared_ptr<void> add_post_set_parameters_callback(PostSetParameters function);

  // Values given for parameters that were not declared so far.
  std::vector<std::string> unused_parameter_overrides() const;

  // For the classes of this library.
  const std::shared_ptr<executor::NodeState>& state() const noexcept { return state_; }

 private:
  std::shared_ptr<executor::NodeState> state_;
};

}  // namespace cie
