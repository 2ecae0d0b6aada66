#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <string_view>

#include <rclcpp/rclcpp.hpp>

using rmw_double::Bus;

namespace rclcpp {

void log(const char* severity, const Logger& logger, const char* format, ...) {
  std::array<char, 1024> text{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  std::fprintf(stderr, "[%s] [%lld.%09ld] [%s]: %s\n", severity, static_cast<long long>(now.tv_sec),
               now.tv_nsec, logger.name.c_str(), text.data());
}

// --- timers, waitables, events --------------------------------------------------------------------

JumpHandler::SharedPtr Clock::create_jump_callback(
    std::function<void()> before, std::function<void(const rcl_time_jump_t&)> after,
    const rcl_jump_threshold_t& threshold) {
  return std::make_shared<JumpHandler>(
      clock_, JumpListener{threshold, [before = std::move(before), after = std::move(after)](
                                          const rcl_time_jump_t& jumped, bool is_before) {
                             if (is_before && before) before();
                             if (!is_before && after) after(jumped);
                           }});
}

namespace {

// What remains of the period remains so where the time becomes another; a step backwards beyond the
// last call begins a new period.
void on_jump(rcl_timer_t& timer, const rcl_time_jump_t& jumped, bool is_before) {
  std::int64_t now = 0;
  rcl_clock_get_now(timer.clock, &now);
  const bool is_change = jumped.clock_change == RCL_ROS_TIME_ACTIVATED ||
                         jumped.clock_change == RCL_ROS_TIME_DEACTIVATED;
  if (is_before) {
    if (is_change && now != 0) timer.time_credit.store(timer.next_call_time.load() - now);
  } else if (is_change) {
    if (now == 0) return;
    if (const std::int64_t credit = timer.time_credit.exchange(0); credit != 0) {
      timer.next_call_time.store(now - credit + timer.period);
      timer.last_call_time.store(now - credit);
    }
  } else if (timer.next_call_time.load() > now && now < timer.last_call_time.load()) {
    timer.next_call_time.store(now + timer.period);
    timer.last_call_time.store(now);
  }
}

}  // namespace

TimerBase::TimerBase(Clock::SharedPtr clock, std::chrono::nanoseconds period)
    : clock_(std::move(clock)),
      timer_handle_(new rcl_timer_t,
                    [kept = clock_->shared()](rcl_timer_t* timer) { delete timer; }) {
  timer_handle_->clock = clock_->get_clock_handle();
  timer_handle_->period = period.count();
  rcl_timer_reset(timer_handle_.get());
  timer_handle_->last_call_time.store(timer_handle_->next_call_time.load() - period.count());
  if (timer_handle_->clock->type != RCL_ROS_TIME) return;
  jumps_ = std::make_shared<JumpHandler>(
      clock_->shared(),
      JumpListener{{true, {1}, {-1}},
                   [timer = timer_handle_.get()](const auto& jumped, bool before) {
                     on_jump(*timer, jumped, before);
                   }});
}

std::chrono::nanoseconds TimerBase::time_until_trigger() const {
  std::int64_t until = 0;
  return rcl_timer_get_time_until_next_call(timer_handle_.get(), &until) == RCL_RET_OK
             ? std::chrono::nanoseconds{until}
             : std::chrono::nanoseconds::max();
}

#if RCLCPP_VERSION_MAJOR >= 28
void TimerBase::set_on_reset_callback(const std::function<void(std::size_t)>& callback) {
  const std::lock_guard lock{on_reset_mutex_};
  clear_on_reset_callback();
  on_reset_ = callback;
  const auto call = [](const void* function, std::size_t count) {
    (*static_cast<const std::function<void(std::size_t)>*>(function))(count);
  };
  rcl_timer_set_on_reset_callback(timer_handle_.get(), call, &on_reset_);
}
#endif
void TimerBase::clear_on_reset_callback() {
  const std::lock_guard lock{on_reset_mutex_};
  if (!on_reset_) return;
  rcl_timer_set_on_reset_callback(timer_handle_.get(), nullptr, nullptr);
  on_reset_ = nullptr;
}

std::shared_ptr<void> Waitable::take_data_by_entity_id(std::size_t) {
  throw std::runtime_error{
      "Custom waitables should override take_data_by_entity_id if they want to use it."};
}
void Waitable::set_on_ready_callback(std::function<void(std::size_t, int)>) {
  throw std::runtime_error{
      "Custom waitables should override set_on_ready_callback if they want to use it."};
}
void Waitable::clear_on_ready_callback() {
  throw std::runtime_error{
      "Custom waitables should override clear_on_ready_callback if they want to use it and make "
      "sure to call it on the waitable destructor."};
}

EventHandlerOfDouble::SharedPtr make_event_handler(const std::shared_ptr<rmw_double::Event>& event,
                                                   const EventCallbacks& callbacks,
                                                   bool use_default, const char* topic,
                                                   std::shared_ptr<const void> parent) {
  using Info = QOSRequestedIncompatibleQoSInfo;
  using Function = QOSRequestedIncompatibleQoSCallbackType;
  if (callbacks.incompatible_qos_callback) {
    return std::make_shared < RCLCPP_DOUBLE_EVENT_HANDLER() < Function,
           Info >> (event, callbacks.incompatible_qos_callback, std::move(parent));
  }
  if (!use_default) return nullptr;
  const auto warn = [topic = std::string{topic}](Info&) {
    RCLCPP_WARN(get_logger("rclcpp"), "incompatible QoS on topic %s: no messages will be sent",
                topic.c_str());
  };
#if RCLCPP_VERSION_MAJOR < 21
  using Kept = std::decay_t<decltype(warn)>;
#else
  using Kept = Function;
#endif
  return std::make_shared < RCLCPP_DOUBLE_EVENT_HANDLER() < Kept,
         Info >> (event, warn, std::move(parent));
}

// --- topics and services --------------------------------------------------------------------------

SubscriptionBase::SubscriptionBase(std::string topic, const QoS& qos,
                                   const SubscriptionEventCallbacks& callbacks,
                                   bool use_default_callbacks, bool is_serialized)
    : topic_(std::move(topic)),
      is_serialized_(is_serialized),
      handle_(std::make_shared<rcl_subscription_t>(
          std::make_shared<rmw_double::Reader>(qos.get_rmw_qos_profile(), true))) {
  const auto event = std::make_shared<rmw_double::Event>();
  if (auto handler =
          make_event_handler(event, callbacks, use_default_callbacks, get_topic_name(), handle_))
    events_.emplace(RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS, std::move(handler));
  if (callbacks.message_lost_callback) {
    using Handler = RCLCPP_DOUBLE_EVENT_HANDLER()<QOSMessageLostCallbackType, QOSMessageLostInfo>;
    const std::shared_ptr<rmw_double::Event> lost{handle_->reader, &handle_->reader->lost};
    events_.emplace(RCL_SUBSCRIPTION_MESSAGE_LOST,
                    std::make_shared<Handler>(lost, callbacks.message_lost_callback, handle_));
  }
  Bus::get().join(topic_, {.owner = handle_->reader,
                           .reader = handle_->reader,
                           .qos = handle_->reader->qos(),
                           .incompatible = event});
}
SubscriptionBase::~SubscriptionBase() {
#if RCLCPP_VERSION_MAJOR < 28
  clear_on_new_message_callback();
  for (const auto& [type, event] : events_)
    event->clear_on_ready_callback();
#endif
}

std::shared_ptr<SerializedMessage> SubscriptionBase::create_serialized_message() {
  return std::make_shared<SerializedMessage>();
}
bool SubscriptionBase::take_type_erased(void* message, MessageInfo& info) {
  const auto sample = reader().take();
  if (!sample) return false;
  copy(sample->data.get(), message);
  info.get_rmw_message_info() = sample->info;
  return true;
}
bool SubscriptionBase::take_serialized(SerializedMessage& message, MessageInfo& info) {
  const auto sample = reader().take();
  if (!sample) return false;
  serialize(sample->data.get(), message);
  info.get_rmw_message_info() = sample->info;
  return true;
}
bool SubscriptionBase::matches_any_intra_process_publishers(const rmw_gid_t* sender) const {
  return process_ && Bus::get().is_process_publisher(sender->number);
}

PublisherBase::PublisherBase(std::string topic, const QoS& qos,
                             const PublisherEventCallbacks& callbacks, bool use_process)
    : topic_(std::move(topic)),
      use_process_(use_process),
      qos_(qos.get_rmw_qos_profile()),
      gid_{Bus::get().new_gid()},
      incompatible_(std::make_shared<rmw_double::Event>()) {
  events_.push_back(
      make_event_handler(incompatible_, callbacks, true, topic_.c_str(), incompatible_));
  Bus::get().join(topic_, {.owner = incompatible_, .qos = qos_, .incompatible = incompatible_});
  if (use_process_) Bus::get().add_process_publisher(gid_.number);
}
PublisherBase::~PublisherBase() {
  for (const auto& event : events_)
    event->clear_on_ready_callback();
  Bus::get().leave(topic_, incompatible_);
  if (use_process_) Bus::get().remove_process_publisher(gid_.number);
}
std::size_t PublisherBase::get_subscription_count() const {
  return Bus::get().readers(topic_, qos_);
}
void PublisherBase::write(std::shared_ptr<const void> message) {
  rmw_double::Sample sample{.data = std::move(message)};
  sample.info.publisher_gid = gid_;
  Bus::get().write(topic_, qos_, std::move(sample));
}

void ServiceBase::respond(const rmw_request_id_t& header, std::shared_ptr<const void> response) {
  Bus::get().write("response " + name_, reader_->qos(),
                   {.data = std::move(response), .request = header});
}
void ClientBase::send(std::shared_ptr<const void> request, std::int64_t sequence_number) {
  Bus::get().write("request " + name_, reader_->qos(),
                   {.data = std::move(request), .request = {gid_, sequence_number}});
}
bool ClientBase::service_is_ready() const {
  return Bus::get().readers("request " + name_, reader_->qos()) > 0;
}

// --- groups, nodes, executors ---------------------------------------------------------------------

GuardCondition::SharedPtr CallbackGroup::notify_of(const Context::SharedPtr& context) {
  const std::lock_guard lock{notify_mutex_};
  if (!notify_ || notify_->get_context() != context)
    notify_ = std::make_shared<GuardCondition>(context);
  return notify_;
}
void CallbackGroup::trigger_notify_guard_condition() {
  const std::lock_guard lock{notify_mutex_};
  if (notify_) notify_->trigger();
}
void CallbackGroup::collect_all_ptrs(
    const std::function<void(const SubscriptionBase::SharedPtr&)>& subscription,
    const std::function<void(const ServiceBase::SharedPtr&)>& service,
    const std::function<void(const ClientBase::SharedPtr&)>& client,
    const std::function<void(const TimerBase::SharedPtr&)>& timer,
    const std::function<void(const Waitable::SharedPtr&)>& waitable) const {
  const std::lock_guard lock{mutex_};
  const auto tell =
      [this]<typename Entity>(const std::function<void(const std::shared_ptr<Entity>&)>& function) {
        for (const auto& each : std::get<All<Entity>>(entities_)) {
          if (const auto alive = each.lock()) function(alive);
        }
      };
  tell(subscription);
  tell(service);
  tell(client);
  tell(timer);
  tell(waitable);
}

namespace node_interfaces {

NodeBaseInterface::NodeBaseInterface(const std::string& name, const std::string& name_space,
                                     Context::SharedPtr context)
    : name_(name),
      namespace_(name_space.ends_with('/') ? name_space : name_space + '/'),
      full_name_(namespace_ + name_),
      context_(std::move(context)),
      notify_(std::make_shared<GuardCondition>(context_)) {
  if (!context_->is_valid()) throw std::runtime_error{"context is not valid"};
  default_group_ = create_callback_group(CallbackGroupType::MutuallyExclusive, true);
}
CallbackGroup::SharedPtr NodeBaseInterface::create_callback_group(CallbackGroupType type,
                                                                  bool automatically_add) {
  auto group = std::make_shared<CallbackGroup>(type, context_, automatically_add);
  const std::lock_guard lock{mutex_};
  groups_.push_back(group);
  return group;
}
bool NodeBaseInterface::callback_group_in_node(const CallbackGroup::SharedPtr& group) {
  const std::lock_guard lock{mutex_};
  return std::ranges::any_of(groups_, [&](const auto& each) { return each.lock() == group; });
}
void NodeBaseInterface::for_each_callback_group(
    const std::function<void(CallbackGroup::SharedPtr)>& function) {
  const std::lock_guard lock{mutex_};
  for (const auto& each : groups_) {
    if (auto alive = each.lock()) function(std::move(alive));
  }
}
std::string NodeBaseInterface::resolved(const std::string& name) const {
  if (name.starts_with('/')) return name;
  return name.starts_with("~/") ? full_name_ + name.substr(1) : namespace_ + name;
}

void NodeWaitablesInterface::add_waitable(const Waitable::SharedPtr& waitable,
                                          const CallbackGroup::SharedPtr& group) {
  const auto in = group ? group : base_.get_default_callback_group();
  if (!base_.callback_group_in_node(in))
    throw std::runtime_error{"Cannot create waitable, group not in node."};
  in->add(waitable);
  base_.trigger_notify_guard_condition();
  in->trigger_notify_guard_condition();
}

}  // namespace node_interfaces

void Node::place(const CallbackGroup::SharedPtr& group,
                 const std::function<void(CallbackGroup&)>& function) {
  const auto in = group ? group : base_->get_default_callback_group();
  if (!base_->callback_group_in_node(in))
    throw std::runtime_error{"Cannot create it, callback group not in node."};
  function(*in);
  base_->trigger_notify_guard_condition();
  in->trigger_notify_guard_condition();
}

// Services of parameters, the one that sets them works; and the subscription of rclcpp's source of
// time. All in the default group, before the user has anything there.
Node::Node(const std::string& name, const std::string& name_space, const NodeOptions& options)
    : options_(options),
      base_(std::make_shared<node_interfaces::NodeBaseInterface>(name, name_space,
                                                                 options.context())),
      waitables_(std::make_shared<node_interfaces::NodeWaitablesInterface>(*base_)) {
  using rcl_interfaces::msg::ParameterEvent;
  using rcl_interfaces::srv::SetParameters;
  parameter_events_ = create_publisher<ParameterEvent>("/parameter_events", 1000);
  for (const char* const each :
       {"get_parameters", "get_parameter_types", "set_parameters", "set_parameters_atomically",
        "describe_parameters", "list_parameters"}) {
    own_.push_back(create_service<SetParameters>(
        std::string{"~/"} + each, [this, sets = std::string_view{each} == "set_parameters"](
                                      const SetParameters::Request::SharedPtr& request,
                                      const SetParameters::Response::SharedPtr& response) {
          if (!sets) return;
          for (const auto& [parameter, value] : request->parameters)
            response->results.push_back(set_parameter({parameter, value.integer_value}));
        }));
  }
  own_.push_back(
      create_subscription<ParameterEvent>("/parameter_events", 100, [](const ParameterEvent&) {}));
}

std::shared_ptr<Node::OnSet> Node::add_on_set_parameters_callback(OnSet function) {
  auto handle = std::make_shared<OnSet>(std::move(function));
  const std::lock_guard lock{parameters_mutex_};
  on_set_.push_back(handle);
  return handle;
}
rcl_interfaces::msg::SetParametersResult Node::set_parameter(const Parameter& parameter) {
  const std::lock_guard lock{parameters_mutex_};
  for (const auto& each : on_set_) {
    const auto function = each.lock();
    if (!function) continue;
    if (auto result = (*function)({parameter}); !result.successful) return result;
  }
  parameters_[parameter.get_name()] = parameter.as_int();
  parameter_events_->publish(rcl_interfaces::msg::ParameterEvent{get_fully_qualified_name()});
  return {.successful = true};
}
std::int64_t Node::get_parameter(const std::string& name) const {
  const std::lock_guard lock{parameters_mutex_};
  return parameters_.at(name);
}

Executor::Executor(const ExecutorOptions& options)
    :
#if RCLCPP_VERSION_MAJOR < 21
      interrupt_guard_condition_(options.context),
#else
      interrupt_guard_condition_(std::make_shared<GuardCondition>(options.context)),
#endif
      shutdown_guard_condition_(std::make_shared<GuardCondition>(options.context)),
      context_(options.context),
      shutdown_callback_handle_(context_->add_on_shutdown_callback(
          [condition = std::weak_ptr{shutdown_guard_condition_}] {
            if (const auto alive = condition.lock()) alive->trigger();
          })) {
}
Executor::~Executor() { context_->remove_on_shutdown_callback(shutdown_callback_handle_); }
void Executor::cancel() {
  spinning.store(false);
#if RCLCPP_VERSION_MAJOR < 21
  interrupt_guard_condition_.trigger();
#else
  interrupt_guard_condition_->trigger();
#endif
}

// One callback after the other, until the future is there.
FutureReturnCode Executor::spin_until_future_complete_impl(std::chrono::nanoseconds timeout,
                                                           const WaitForFuture& wait_for_future) {
  using std::chrono::steady_clock;
  constexpr std::chrono::nanoseconds kNow{0};
  if (wait_for_future(kNow) == std::future_status::ready) return FutureReturnCode::SUCCESS;
  const auto end = steady_clock::now() + std::max(timeout, kNow);
  if (spinning.exchange(true))
    throw std::runtime_error{"spin_until_future_complete() called while already spinning"};
  const std::shared_ptr<void> at_end{nullptr, [this](void*) { spinning.store(false); }};
  std::chrono::nanoseconds left = timeout;
  while (ok(context_) && spinning.load()) {
    spin_once_impl(left);
    if (wait_for_future(kNow) == std::future_status::ready) return FutureReturnCode::SUCCESS;
    if (timeout < kNow) continue;
    left = end - steady_clock::now();
    if (left <= kNow) return FutureReturnCode::TIMEOUT;
  }
  return FutureReturnCode::INTERRUPTED;
}

}  // namespace rclcpp
