#include "entity.hpp"

#include "distributions.hpp"
#include "registration.hpp"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <functional>
#include <string_view>
#include <typeinfo>
#include <utility>

#include <cxxabi.h>
#include <rcl/client.h>
#include <rcl/error_handling.h>
#include <rcl/service.h>
#include <rcl/subscription.h>
#include <rclcpp/exceptions.hpp>
#include <rclcpp/experimental/subscription_intra_process_base.hpp>
#include <rclcpp/logging.hpp>
#include <rclcpp/message_info.hpp>

namespace cie_rclcpp {
namespace {

std::string demangled(const std::type_info& type) {
  const std::unique_ptr<char, void (*)(void*)> name{
      abi::__cxa_demangle(type.name(), nullptr, nullptr, nullptr), std::free};
  return name ? name.get() : type.name();
}

// How many messages the middleware keeps; 0: all, or what it likes.
std::size_t bounded_depth(const rclcpp::QoS& qos) {
  return qos.history() == rclcpp::HistoryPolicy::KeepLast ? qos.depth() : 0;
}

// rclcpp's clear_…() throws where rcl fails, which leaves nothing to be done.
template <typename Function>
void quietly(Function function) noexcept {
  try {
    function();
  } catch (const std::exception& error) {
    RCLCPP_WARN(rclcpp::get_logger("cie_rclcpp"), "%s", error.what());
  }
}

// What rcl refuses is logged, and the executor goes on, as rclcpp's do.
template <typename Take>
bool is_taken(const char* what, const std::string& name, Take take) {
  try {
    return take();
  } catch (const rclcpp::exceptions::RCLError& error) {
    RCLCPP_ERROR(rclcpp::get_logger("cie_rclcpp"), "taking a %s of '%s' failed: %s", what,
                 name.c_str(), error.what());
    return false;
  }
}

// What rcl says of a take: whether there was something.
bool was_there(rcl_ret_t taken, rcl_ret_t nothing) {
  if (taken != RCL_RET_OK && taken != nothing) rclcpp::exceptions::throw_from_rcl_error(taken);
  return taken == RCL_RET_OK;
}

std::uint64_t number_of(const void* bytes, std::size_t size) {
  return std::hash<std::string_view>{}({static_cast<const char*>(bytes), size});
}
std::uint64_t writer_of(const rclcpp::MessageInfo& info) {
  const rmw_gid_t& gid = info.get_rmw_message_info().publisher_gid;
  return number_of(&gid, sizeof(gid));
}
std::uint64_t writer_of(const rmw_request_id_t& request) {
  return number_of(&request, offsetof(rmw_request_id_t, sequence_number));
}

// `kept` lives as long as the function, and goes first.
template <typename... Kept>
auto notice_of_middleware(Entity::Notice notice, Kept... kept) {
  return [notice = std::move(notice), ... kept = std::move(kept)](std::size_t count) {
    notice(Inbox::Source::middleware, count, 0);
  };
}

bool has_handler_of_lost(const rclcpp::SubscriptionBase& subscription) {
  for (const auto& handler : subscription.get_event_handlers()) {
    const QosEventHandler& each = event_handler(handler);
    if (demangled(typeid(each)).find("message_lost") != std::string::npos) return true;
  }
  return false;
}

// Which publishers a subscription also hears through the process is a protected member function.
class OtherWay : public rclcpp::SubscriptionBase {
 public:
  static bool has(const rclcpp::SubscriptionBase& subscription, const rmw_gid_t& publisher) {
    return (subscription.*(&OtherWay::matches_any_intra_process_publishers))(&publisher);
  }
};

// What an entity's functions share for as long as they are the ones that are called: others may have taken
// their place, those of the entity's next executor for example.
class Listening {
 public:
  std::shared_ptr<void> begin() {
    auto token = std::make_shared<char>();
    token_ = token;
    return token;
  }
  bool is_over() const noexcept { return token_.expired(); }

 private:
  std::weak_ptr<void> token_;
};

class SubscriptionEntity final : public Entity {
 public:
  explicit SubscriptionEntity(const rclcpp::SubscriptionBase::SharedPtr& subscription)
      : subscription_(subscription),
        process_(subscription->get_intra_process_waitable()),
        topic_(subscription->get_topic_name()),
        depth_(bounded_depth(subscription->get_actual_qos())),
        form_(form_of(*subscription)) {}

  std::string name() const override { return topic_; }
  cie::CallbackKind kind() const noexcept override { return cie::CallbackKind::subscription; }
  std::size_t depth() const override { return depth_; }
  std::size_t process_depth() const override {
    return process_.expired() ? 0 : (depth_ > 0 ? depth_ : 1024);
  }
  // What publishers of the same process send, too.
  bool is_shared() const override { return !process_.expired(); }

  void connect(Notice notice) override {
    const auto token = listening_.begin();
    if (const auto process = process_.lock()) {
      process->set_on_ready_callback([notice, token](std::size_t count, int entity) {
        notice(Inbox::Source::process, count, entity);
      });
    }
    const auto subscription = subscription_.lock();
    if (!subscription) return;
    // Whoever takes the event takes it from others: a handler of the user's has it alone.
    std::shared_ptr<LostMessages> lost;
    const auto handle = subscription->get_subscription_handle();
    if (!has_handler_of_lost(*subscription)) {
      lost = std::make_shared<LostMessages>(handle, notice);
      lost_ = lost;
    }
    subscription->set_on_new_message_callback(
        notice_of_middleware(std::move(notice), token, std::move(lost),
                             std::make_shared<Registration<rcl_subscription_t>>(
                                 handle, rcl_subscription_set_on_new_message_callback)));
  }
  void disconnect() noexcept override {
    if (listening_.is_over()) return;
    if (const auto process = process_.lock()) quietly([&] { process->clear_on_ready_callback(); });
    if (const auto subscription = subscription_.lock()) {
      quietly([&] { subscription->clear_on_new_message_callback(); });
    }
  }

  std::uint32_t take_lost() noexcept override {
    const auto subscription = subscription_.lock();  // lives longer than what it keeps
    const auto lost = lost_.lock();
    return subscription && lost ? lost->take() : 0;
  }

  bool run_next(Inbox::Source source, int entity, const Begin& begin) override {
    if (source == Inbox::Source::process) return run_of_process(entity, begin);
    const auto subscription = subscription_.lock();
    if (!subscription) return false;
    if (form_ == MessageForm::serialized) return run_serialized(*subscription, begin);
    if (subscription->can_loan_messages()) return run_loaned(*subscription, begin);
    auto message = subscription->create_message();
    rclcpp::MessageInfo info;
    const bool is_ours =
        is_taken("message", topic_,
                 [&] { return subscription->take_type_erased(message.get(), info); }) &&
        is_for_this_callback(*subscription, info);
    if (is_ours) {
      begin(info.get_rmw_message_info().source_timestamp, writer_of(info));
      subscription->handle_message(message, info);
    }
    subscription->return_message(message);
    return is_ours;
  }

 private:
  // What a publisher of the same process sent comes through the process, too.
  static bool is_for_this_callback(const rclcpp::SubscriptionBase& subscription,
                                   const rclcpp::MessageInfo& info) {
    return !OtherWay::has(subscription, info.get_rmw_message_info().publisher_gid);
  }

  bool run_of_process(int entity, const Begin& begin) {
    const auto process = process_.lock();
    if (!process) return false;
    auto message = process->take_data_by_entity_id(static_cast<std::size_t>(entity));
    if (!message) return false;
    begin(0, 0);
    execute_waitable(*process, message);
    return true;
  }

  bool run_serialized(rclcpp::SubscriptionBase& subscription, const Begin& begin) const {
    auto message = subscription.create_serialized_message();
    rclcpp::MessageInfo info;
    const bool is_ours =
        is_taken("message", topic_, [&] { return subscription.take_serialized(*message, info); });
    if (is_ours) {
      begin(info.get_rmw_message_info().source_timestamp, writer_of(info));
      subscription.handle_serialized_message(message, info);
    }
    subscription.return_serialized_message(message);
    return is_ours;
  }

  bool run_loaned(rclcpp::SubscriptionBase& subscription, const Begin& begin) const {
    void* message = nullptr;
    rclcpp::MessageInfo info;
    const auto handle = subscription.get_subscription_handle();
    const bool has_loan = is_taken("loaned message", topic_, [&] {
      return was_there(
          rcl_take_loaned_message(handle.get(), &message, &info.get_rmw_message_info(), nullptr),
          RCL_RET_SUBSCRIPTION_TAKE_FAILED);
    });
    if (!has_loan) return false;
    const auto give_back = [&handle](void* loan) {
      if (rcl_return_loaned_message_from_subscription(handle.get(), loan) != RCL_RET_OK) {
        rcl_reset_error();
      }
    };
    const std::unique_ptr<void, decltype(give_back)> loan{message, give_back};
    if (!is_for_this_callback(subscription, info)) return false;
    begin(info.get_rmw_message_info().source_timestamp, writer_of(info));
    subscription.handle_loaned_message(message, info);
    return true;
  }

  const std::weak_ptr<rclcpp::SubscriptionBase> subscription_;
  const std::weak_ptr<rclcpp::Waitable> process_;
  const std::string topic_;
  const std::size_t depth_;
  const MessageForm form_;
  Listening listening_;
  std::weak_ptr<LostMessages> lost_;  // the notice's
};

// The five services of a lifecycle node are rcl's state machine's: a LifecycleNode ends them, and the middleware's
// calls with them, before it drops rclcpp's objects, whose copies of the handle point at nothing then.
bool is_rcls(const rclcpp::ServiceBase& service) {
  return demangled(typeid(service)).find("lifecycle_msgs::srv::") != std::string::npos;
}

class ServiceEntity final : public Entity {
 public:
  explicit ServiceEntity(const rclcpp::ServiceBase::SharedPtr& service)
      : service_(service),
        name_(service->get_service_name()),
        depth_(bounded_depth(service->get_request_subscription_actual_qos())) {}

  std::string name() const override { return name_; }
  cie::CallbackKind kind() const noexcept override { return cie::CallbackKind::service; }
  std::size_t depth() const override { return depth_; }
  void connect(Notice notice) override {
    if (const auto service = service_.lock()) {
      std::shared_ptr<Registration<rcl_service_t>> registration;
      if (!is_rcls(*service)) {
        registration = std::make_shared<Registration<rcl_service_t>>(
            service->get_service_handle(), rcl_service_set_on_new_request_callback);
      }
      service->set_on_new_request_callback(
          notice_of_middleware(std::move(notice), listening_.begin(), std::move(registration)));
    }
  }
  void disconnect() noexcept override {
    if (listening_.is_over()) return;
    if (const auto service = service_.lock()) {
      quietly([&] { service->clear_on_new_request_callback(); });
    }
  }
  bool run_next(Inbox::Source, int, const Begin& begin) override {
    const auto service = service_.lock();
    if (!service) return false;
    auto header = service->create_request_header();
    auto request = service->create_request();
    rmw_service_info_t info{};
    if (!is_taken("request", name_, [&] {
          return was_there(
              rcl_take_request_with_info(service->get_service_handle().get(), &info, request.get()),
              RCL_RET_SERVICE_TAKE_FAILED);
        })) {
      return false;
    }
    *header = info.request_id;
    begin(info.source_timestamp, writer_of(info.request_id));
    service->handle_request(header, request);
    return true;
  }

 private:
  const std::weak_ptr<rclcpp::ServiceBase> service_;
  const std::string name_;
  const std::size_t depth_;
  Listening listening_;
};

class ClientEntity final : public Entity {
 public:
  explicit ClientEntity(const rclcpp::ClientBase::SharedPtr& client)
      : client_(client),
        name_(client->get_service_name()),
        depth_(bounded_depth(client->get_response_subscription_actual_qos())) {}

  std::string name() const override { return name_; }
  cie::CallbackKind kind() const noexcept override { return cie::CallbackKind::client; }
  std::size_t depth() const override { return depth_; }
  bool is_shared() const override { return true; }  // answers to other clients
  void connect(Notice notice) override {
    if (const auto client = client_.lock()) {
      client->set_on_new_response_callback(notice_of_middleware(
          std::move(notice), listening_.begin(),
          std::make_shared<Registration<rcl_client_t>>(client->get_client_handle(),
                                                       rcl_client_set_on_new_response_callback)));
    }
  }
  void disconnect() noexcept override {
    if (listening_.is_over()) return;
    if (const auto client = client_.lock()) {
      quietly([&] { client->clear_on_new_response_callback(); });
    }
  }
  bool run_next(Inbox::Source, int, const Begin& begin) override {
    const auto client = client_.lock();
    if (!client) return false;
    auto header = client->create_request_header();
    auto response = client->create_response();
    rmw_service_info_t info{};
    if (!is_taken("response", name_, [&] {
          return was_there(
              rcl_take_response_with_info(client->get_client_handle().get(), &info, response.get()),
              RCL_RET_CLIENT_TAKE_FAILED);
        })) {
      return false;
    }
    *header = info.request_id;
    begin(info.source_timestamp, writer_of(info.request_id));
    client->handle_response(header, response);
    return true;
  }

 private:
  const std::weak_ptr<rclcpp::ClientBase> client_;
  const std::string name_;
  const std::size_t depth_;
  Listening listening_;
};

// "rclcpp_action::Server" of the type with all its template arguments.
std::string name_of_class(const rclcpp::Waitable& waitable) {
  const std::string name = demangled(typeid(waitable));
  return name.substr(0, name.find('<'));
}

class WaitableEntity final : public Entity {
 public:
  WaitableEntity(const rclcpp::Waitable::SharedPtr& waitable,
                 const rclcpp::SubscriptionBase::SharedPtr& owner)
      : owner_(owner),
        has_owner_(owner != nullptr),
        waitable_(waitable),
        name_(name_of_class(*waitable)),
        is_event_(dynamic_cast<const QosEventHandler*>(waitable.get()) != nullptr) {}

  std::string name() const override { return name_; }
  cie::CallbackKind kind() const noexcept override { return cie::CallbackKind::waitable; }
  void connect(Notice notice) override {
    const auto owner = owner_.lock();
    const auto waitable = waitable_.lock();
    if (!waitable) return;
    const auto is_partial = std::make_shared<std::atomic<bool>>(!kNoticesAreWhole);
    // The number by reference, so that one that is not there is not read.
    waitable->set_on_ready_callback([notice = std::move(notice), is_partial,
                                     token = listening_.begin()](std::size_t count,
                                                                 const int& entity) {
      notice(Inbox::Source::middleware, count, is_partial->load() ? Arrival::kAnyEntity : entity);
    });
    is_partial->store(false);
  }
  void disconnect() noexcept override {
    const auto owner = owner_.lock();
    if (listening_.is_over()) return;
    if (const auto waitable = waitable_.lock()) {
      quietly([&] { waitable->clear_on_ready_callback(); });
    }
  }
  // A waitable may have nothing to take and yet something to do; a QoS event may not.
  bool run_next(Inbox::Source, int entity, const Begin& begin) override {
    const auto owner = owner_.lock();  // before the waitable, and so let go of after it
    if (has_owner_ && !owner) return false;
    const auto waitable = waitable_.lock();
    if (!waitable) return false;
    if (entity == Arrival::kAnyEntity && !is_event_) return run_all(*waitable, begin);
    auto data = waitable->take_data_by_entity_id(static_cast<std::size_t>(entity));
    if (is_event_ && !data) return false;
    begin(0, 0);
    execute_waitable(*waitable, data);
    return true;
  }

 private:
  static constexpr std::size_t kMostEntities = 5;  // an action client's

  // One of them is ready, and it is not known which: an action's ignore a take that brings nothing. One that
  // has nothing to take has something to do.
  static bool run_all(rclcpp::Waitable& waitable, const Begin& begin) {
    begin(0, 0);
    bool has_data = false;
    std::shared_ptr<void> data;
    for (std::size_t each = 0; each < kMostEntities; ++each) {
      data = waitable.take_data_by_entity_id(each);
      if (!data) continue;
      has_data = true;
      execute_waitable(waitable, data);
    }
    if (!has_data) execute_waitable(waitable, data);
    return true;
  }

  // A handler of events keeps rcl's handle of the subscription, and rclcpp's own handlers use the
  // subscription itself. So one is not taken without its owner, nor let go of after it.
  const std::weak_ptr<rclcpp::SubscriptionBase> owner_;
  const bool has_owner_;
  const std::weak_ptr<rclcpp::Waitable> waitable_;
  const std::string name_;
  const bool is_event_;
  Listening listening_;
};

}  // namespace

std::unique_ptr<Entity> make_entity(const rclcpp::SubscriptionBase::SharedPtr& subscription) {
  return std::make_unique<SubscriptionEntity>(subscription);
}
std::unique_ptr<Entity> make_entity(const rclcpp::ServiceBase::SharedPtr& service) {
  return std::make_unique<ServiceEntity>(service);
}
std::unique_ptr<Entity> make_entity(const rclcpp::ClientBase::SharedPtr& client) {
  return std::make_unique<ClientEntity>(client);
}
std::unique_ptr<Entity> make_entity(const rclcpp::Waitable::SharedPtr& waitable,
                                    const rclcpp::SubscriptionBase::SharedPtr& owner) {
  return std::make_unique<WaitableEntity>(waitable, owner);
}

rclcpp::SubscriptionBase::SharedPtr owner_of(
    const rclcpp::Waitable::SharedPtr& waitable,
    const std::vector<rclcpp::SubscriptionBase::WeakPtr>& subscriptions) {
  for (const auto& each : subscriptions) {
    auto subscription = each.lock();
    if (!subscription) continue;
    for (const auto& handler : subscription->get_event_handlers()) {
      if (&event_handler(handler) == waitable.get()) return subscription;
    }
  }
  return nullptr;
}

bool is_of_subscription(const rclcpp::Waitable& waitable) {
  return dynamic_cast<const rclcpp::experimental::SubscriptionIntraProcessBase*>(&waitable) !=
         nullptr;
}

// A user's handler is kept as a std::function. So is rclcpp's own since Iron, which only warns of
// what is incompatible. Before it is a lambda, whose name has the arguments of the function that it is in.
bool is_default_event_handler(const rclcpp::Waitable& waitable) {
  if (dynamic_cast<const QosEventHandler*>(&waitable) == nullptr) return false;
  const std::string name = demangled(typeid(waitable));
  constexpr std::string_view kKept = "<std::function<";
  const bool is_function = name.find(kKept) == name.find('<');
  return !is_function ||
         (kOwnHandlersAreFunctions && name.find("incompatible") != std::string::npos);
}

}  // namespace cie_rclcpp
