#include "node_state.hpp"

#include <cie/scheduling/executor_core.hpp>
#include <cie/tracepoints/logical_id.hpp>

#include "client_callback.hpp"
#include "dds/names.hpp"
#include "dds/pinned_library.hpp"
#include "dds/writer.hpp"
#include "endpoint_callbacks.hpp"
#include "guard_condition_callback.hpp"
#include "parameters/parameter_services.hpp"
#include "service_callback.hpp"
#include "services/service_ends.hpp"
#include "subscription_callback.hpp"
#include "timer_callback.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace cie {
namespace executor {

NodeState::NodeState(std::shared_ptr<ContextState> context, std::string_view name,
                     std::string_view name_space, const Remaps& remaps,
                     const ParameterOverrides& parameters)
    : context_(std::move(context)),
      name_(qualified_node_name(name, name_space)),
      trace_(name_),
      parameters_(name_, parameters,
                  [this](auto change, const auto& changed) { publish_change(change, changed); }) {
  for (const auto& [from, to] : remaps) {
    if (!remaps_.emplace(qualified_topic(from, name_), qualified_topic(to, name_)).second) {
      throw std::invalid_argument{"node \"" + name_ + "\" has two remaps of \"" +
                                  qualified_topic(from, name_) + "\": remove one"};
    }
  }
  graph_member_ = context_->graph().add_node(name_);
}

NodeState::~NodeState() = default;

void NodeState::offer_parameters() {
  {
    const std::lock_guard lock{services_mutex_};
    if (services_ != nullptr || is_withdrawn_) return;
    services_ =
        std::make_unique<ParameterServices>(context_, name_, id(), graph_member_, parameters_);
  }
  if (const auto core = executor()) core->configure_new_workers(*this);
}

void NodeState::withdraw_parameters() {
  std::unique_ptr<ParameterServices> services;  // ends without the lock: it may still answer
  const std::lock_guard lock{services_mutex_};
  is_withdrawn_ = true;
  services = std::move(services_);
}

void NodeState::publish_change(ParameterStore::Change change,
                               const std::vector<Parameter>& parameters) {
  const std::lock_guard lock{services_mutex_};
  if (services_ != nullptr) services_->tell(change, parameters);
}

std::string NodeState::resolved(std::string_view name) const {
  const std::string absolute = qualified_topic(name, name_);
  const auto remap = remaps_.find(absolute);
  return remap == remaps_.end() ? absolute : remap->second;
}

std::shared_ptr<GroupState> NodeState::new_group(GroupType type) {
  auto group = std::make_shared<GroupState>(id(), type);
  const std::lock_guard lock{mutex_};
  std::erase_if(groups_, [](const auto& each) { return each.expired(); });
  groups_.push_back(group);
  return group;
}

std::shared_ptr<GroupState> NodeState::group_or_new(const std::shared_ptr<CallbackGroup>& group) {
  if (group == nullptr) return std::make_shared<GroupState>(id(), GroupType::mutually_exclusive);
  const std::lock_guard lock{mutex_};
  if (std::ranges::none_of(groups_,
                           [&](const auto& own) { return own.lock() == group->state(); })) {
    throw std::logic_error{"the callback group given to node \"" + name_ +
                           "\" is another node's: create it with this one"};
  }
  return group->state();
}

void NodeState::add(const std::vector<std::shared_ptr<Callback>>& callbacks) {
  std::shared_ptr<ExecutorCore> executor;
  {
    const std::lock_guard lock{mutex_};
    callbacks_.insert(callbacks_.end(), callbacks.begin(), callbacks.end());
    executor = executor_;
  }
  if (executor == nullptr) return;
  try {
    executor->serve_new(*this, callbacks);
  } catch (...) {
    const std::lock_guard lock{mutex_};
    for (const auto& callback : callbacks)
      std::erase(callbacks_, callback);
    throw;
  }
}

void NodeState::remove(Callback& callback) {
  std::shared_ptr<Callback> removed;
  std::shared_ptr<ExecutorCore> executor;
  {
    const std::lock_guard lock{mutex_};
    const auto found = std::ranges::find(callbacks_, &callback, &std::shared_ptr<Callback>::get);
    if (found != callbacks_.end()) {
      removed = std::move(*found);
      callbacks_.erase(found);
      executor = executor_;
    } else if (!callback.is_closed()) {
      throw std::logic_error{"the callback \"" + callback.logical_id() +
                             "\" to be removed from node \"" + name_ + "\" is another node's"};
    }
    callback.close();
  }
  if (executor != nullptr) executor->withdraw({removed});
  callback.end();
}

void NodeState::remove(SubscriptionCallback& subscription) {
  for (const auto& event : subscription.events())
    remove(*event);
  remove(static_cast<Callback&>(subscription));
}

void NodeState::end() {
  for (const auto& callback : callbacks())
    callback->close();
  if (const auto executor = this->executor()) executor->drop_node(*this);
  std::vector<std::shared_ptr<Callback>> ending;
  {
    const std::lock_guard lock{mutex_};
    ending.swap(callbacks_);
  }
  for (const auto& callback : ending)
    callback->end();
  withdraw_parameters();
}

std::vector<std::shared_ptr<Callback>> NodeState::callbacks() const {
  const std::lock_guard lock{mutex_};
  return callbacks_;
}

void NodeState::join(std::shared_ptr<ExecutorCore> executor) {
  const std::lock_guard lock{mutex_};
  if (executor_ == executor) {
    throw std::logic_error{"node \"" + name_ + "\" was already added to this executor"};
  }
  if (executor_ != nullptr) {
    throw std::logic_error{"node \"" + name_ +
                           "\" belongs to another executor: remove it there first"};
  }
  executor_ = std::move(executor);
}

void NodeState::leave() {
  const std::lock_guard lock{mutex_};
  executor_.reset();
}

std::shared_ptr<ExecutorCore> NodeState::executor() const {
  const std::lock_guard lock{mutex_};
  return executor_;
}

namespace {

trace::CallbackInfo describe(const NodeState& node, const GroupState& group, CallbackKind kind,
                             const std::string& what, const CallbackOptions& options,
                             const std::type_info& symbol) {
  trace::CallbackInfo info;
  info.group = group.id();
  info.node = node.id();
  info.kind = kind;
  info.logical_id = trace::unique_logical_id(
      logical_id(node.name(), kind, options.name.empty() ? what : options.name));
  info.symbol = demangled(symbol);
  if (options.deadline.count() < 0) {
    throw std::invalid_argument{"the deadline of \"" + info.logical_id + "\" is negative"};
  }
  info.deadline_ns = static_cast<std::uint64_t>(options.deadline.count());
  return info;
}

}  // namespace

namespace {

// A callback as the user's: when the last copy of the handle goes, it ends. If the node has gone
// before, it has ended already.
template <typename Kind>
std::shared_ptr<Kind> handle_of(NodeState& node, std::shared_ptr<Kind> callback) {
  Kind* const raw = callback.get();
  return {raw, [owner = node.weak_from_this(), callback = std::move(callback)](Kind*) mutable {
            if (const auto state = owner.lock()) state->remove(*callback);
            callback.reset();
          }};
}

enum class Recurrence : std::uint8_t { periodic, once };

// A timer's name stands in its id where others have their period, and finds its entry of the spec.
void check_timer_name(const NodeState& node, const std::string& name) {
  if (name.empty()) return;
  if (name.find_first_not_of("0123456789") == std::string::npos) {
    throw std::invalid_argument{fmt::format(
        "a timer of node \"{}\" is named \"{}\": digits alone are a period", node.name(), name)};
  }
  const auto id = logical_id(node.name(), CallbackKind::timer, name);
  const auto callbacks = node.callbacks();
  if (std::ranges::any_of(callbacks,
                          [&id](const auto& each) { return each->logical_id() == id; })) {
    throw std::invalid_argument{
        fmt::format("node \"{}\" has a timer named \"{}\" already", node.name(), name)};
  }
}

std::shared_ptr<TimerCallback> create_timer(NodeState& node, Recurrence recurrence,
                                            std::chrono::nanoseconds interval,
                                            std::function<void()> function,
                                            const TimerOptions& options,
                                            const std::type_info& symbol) {
  if (interval < std::chrono::microseconds{1}) {
    throw std::invalid_argument{
        fmt::format("a timer of node \"{}\" has a {} of {} ns: 1000 ns is the least", node.name(),
                    recurrence == Recurrence::periodic ? "period" : "delay", interval.count())};
  }
  check_timer_name(node, options.name);
  auto group = node.group_or_new(options.group);
  auto info = describe(node, *group, CallbackKind::timer, std::to_string(interval.count()),
                       {.name = options.name, .deadline = options.deadline}, symbol);
  if (recurrence == Recurrence::periodic) {
    info.period_ns = static_cast<std::uint64_t>(interval.count());
  }
  auto timer = std::make_shared<TimerCallback>(std::move(group), info, interval.count(),
                                               std::move(function), options);
  node.add({timer});
  return handle_of(node, std::move(timer));
}

}  // namespace

std::shared_ptr<TimerCallback> create_timer(NodeState& node, std::chrono::nanoseconds period,
                                            std::function<void()> function,
                                            const TimerOptions& options,
                                            const std::type_info& symbol) {
  return create_timer(node, Recurrence::periodic, period, std::move(function), options, symbol);
}

std::shared_ptr<TimerCallback> create_one_shot_timer(NodeState& node,
                                                     std::chrono::nanoseconds delay,
                                                     std::function<void()> function,
                                                     const TimerOptions& options,
                                                     const std::type_info& symbol) {
  return create_timer(node, Recurrence::once, delay, std::move(function), options, symbol);
}

std::shared_ptr<GuardConditionCallback> create_guard_condition(NodeState& node,
                                                               std::string_view name,
                                                               std::function<void()> function,
                                                               const CallbackOptions& options,
                                                               const std::type_info& symbol) {
  qualified_topic(name, node.name());  // refuses what is not a name
  auto group = node.group_or_new(options.group);
  auto info = describe(node, *group, CallbackKind::waitable, std::string{name}, options, symbol);
  info.source = name;
  auto guard_condition = std::make_shared<GuardConditionCallback>(std::move(group), std::move(info),
                                                                  std::move(function));
  node.add({guard_condition});
  return handle_of(node, std::move(guard_condition));
}

std::shared_ptr<SubscriptionCallback> create_subscription(
    NodeState& node, std::string_view topic, const QoS& qos, const dds_topic_descriptor& type,
    MessageFunction function, const SubscriptionOptions& options, const std::type_info& symbol) {
  const std::string name = node.resolved(topic);
  auto group = node.group_or_new(options.group);
  auto events = endpoint_callbacks(node, name, options.name, options.event_callbacks);
  auto reader = std::make_unique<Reader>(node.context(), message_topic(name), qos, type,
                                         std::string{}, std::nullopt, std::move(events.events));
  *events.entity = reader->entity();
  reader->announce(node.graph_member());
  auto info = describe(node, *group, CallbackKind::subscription, name, options, symbol);
  info.source = name;
  info.queue_depth = qos.depth();
  auto subscription = std::make_shared<SubscriptionCallback>(
      std::move(group), std::move(info), std::move(reader), std::move(function));
  subscription->set_events(events.callbacks);
  events.callbacks.insert(events.callbacks.begin(), subscription);
  node.add(events.callbacks);
  return handle_of(node, std::move(subscription));
}

std::shared_ptr<ServiceCallback> create_service(
    NodeState& node, std::string_view service, const QoS& qos,
    const dds_topic_descriptor& request_type, const dds_topic_descriptor& response_type,
    ErasedServiceFunction function, const CallbackOptions& options, const std::type_info& symbol) {
  const std::string name = node.resolved(service);
  auto group = node.group_or_new(options.group);
  auto end = make_server_end({.context = node.context(),
                              .graph_node = node.graph_member(),
                              .node = node.id(),
                              .name = name,
                              .qos = qos,
                              .request = request_type,
                              .response = response_type},
                             std::move(function));
  auto info = describe(node, *group, CallbackKind::service, name, options, symbol);
  info.source = name;
  info.queue_depth = qos.depth();
  auto callback = std::make_shared<ServiceCallback>(std::move(group), info, std::move(end));
  node.add({callback});
  return handle_of(node, std::move(callback));
}

std::shared_ptr<ClientCallback> create_client(NodeState& node, std::string_view service,
                                              const QoS& qos,
                                              const dds_topic_descriptor& request_type,
                                              const dds_topic_descriptor& response_type,
                                              const ClientOptions& options,
                                              const std::type_info& symbol) {
  const std::string name = node.resolved(service);
  if (options.timeout.count() < 0) {
    throw std::invalid_argument{"the timeout of a client of \"" + name + "\" is negative"};
  }
  auto group = node.group_or_new(options.group);
  auto end = make_client_end({.context = node.context(),
                              .graph_node = node.graph_member(),
                              .node = node.id(),
                              .name = name,
                              .qos = qos,
                              .request = request_type,
                              .response = response_type});
  auto info = describe(node, *group, CallbackKind::client, name,
                       {.name = options.name, .deadline = options.deadline}, symbol);
  info.source = name;
  info.queue_depth = qos.depth();
  auto client = std::make_shared<ClientCallback>(std::move(group), std::move(info), std::move(end),
                                                 options.timeout.count());
  node.add({client});
  return handle_of(node, std::move(client));
}

std::shared_ptr<Writer> create_writer(NodeState& node, std::string_view topic, const QoS& qos,
                                      const dds_topic_descriptor& type,
                                      const PublisherOptions& options, void (*code)() noexcept) {
  const std::string name = node.resolved(topic);
  auto events = endpoint_callbacks(node, name, options.event_callbacks);
  auto writer = std::make_shared<Writer>(node.context(), node.id(), message_topic(name), qos, type,
                                         std::string{}, std::move(events.events));
  *events.entity = writer->entity();
  writer->announce(node.graph_member());
  writer->keep_loaded(pin_library_of(reinterpret_cast<const void*>(code)));
  if (events.callbacks.empty()) return writer;
  node.add(events.callbacks);
  Writer* const raw = writer.get();
  return {raw, [owner = node.weak_from_this(), writer = std::move(writer),
                callbacks = std::move(events.callbacks)](Writer*) mutable {
            if (const auto state = owner.lock()) {
              for (const auto& callback : callbacks)
                state->remove(*callback);
            }
            writer.reset();
          }};
}

}  // namespace executor

Node::Node(const Context& context, std::string_view name, std::string_view name_space,
           const Remaps& remaps, const ParameterOverrides& parameters)
    : state_(std::make_shared<executor::NodeState>(context.state(), name, name_space, remaps,
                                                   parameters)) {}

Node::~Node() { state_->end(); }

ParameterValue Node::declare_parameter(std::string_view name, ParameterValue value,
                                       ParameterDescriptor descriptor) {
  state_->offer_parameters();
  return state_->parameters().declare(name, std::move(value), std::move(descriptor));
}
void Node::undeclare_parameter(std::string_view name) { state_->parameters().undeclare(name); }
bool Node::has_parameter(std::string_view name) const { return state_->parameters().has(name); }
ParameterValue Node::get_parameter(std::string_view name) const {
  return state_->parameters().get(name);
}
SetParametersResult Node::set_parameter(std::string_view name, ParameterValue value) {
  return state_->parameters().set({{std::string{name}, std::move(value)}});
}
SetParametersResult Node::set_parameters_atomically(const std::vector<Parameter>& parameters) {
  return state_->parameters().set(parameters);
}
std::vector<SetParametersResult> Node::set_parameters(const std::vector<Parameter>& parameters) {
  std::vector<SetParametersResult> results;
  results.reserve(parameters.size());
  for (const Parameter& parameter : parameters)
    results.push_back(state_->parameters().set({parameter}));
  return results;
}
ParameterDescriptor Node::describe_parameter(std::string_view name) const {
  return state_->parameters().describe(name);
}
std::vector<std::string> Node::list_parameters(const std::vector<std::string>& prefixes,
                                               std::uint64_t depth) const {
  return state_->parameters().list(prefixes, depth);
}
std::shared_ptr<void> Node::add_on_set_parameters_callback(OnSetParameters function) {
  return state_->parameters().add_on_set(std::move(function));
}
std::shared_ptr<void> Node::add_post_set_parameters_callback(PostSetParameters function) {
  return state_->parameters().add_post_set(std::move(function));
}
std::vector<std::string> Node::unused_parameter_overrides() const {
  return state_->parameters().unused_overrides();
}

const std::string& Node::fully_qualified_name() const noexcept { return state_->name(); }

std::shared_ptr<CallbackGroup> Node::create_callback_group(GroupType type) {
  return std::make_shared<CallbackGroup>(state_->new_group(type));
}

GroupType CallbackGroup::type() const noexcept { return state_->type(); }
GroupId CallbackGroup::id() const noexcept { return state_->id(); }

}  // namespace cie
