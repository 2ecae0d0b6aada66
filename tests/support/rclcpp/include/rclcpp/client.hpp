#pragma once

#include <chrono>
#include <future>
#include <map>
#include <mutex>

#include <rcl/client.h>
#include <rclcpp/service.hpp>

namespace rclcpp {

class ClientBase : public ServiceEnd<rcl_client_t> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(ClientBase)
  ClientBase(const std::string& name, const rmw_qos_profile_t& profile)
      : ServiceEnd(name, profile), gid_(rmw_double::Bus::get().new_gid()) {
    handle_->gid = gid_;
    listen("response " + name);  // those for others, too
  }
  const char* get_service_name() const { return name_.c_str(); }
  QoS get_response_subscription_actual_qos() const { return QoS{reader_->qos()}; }
  void set_on_new_response_callback(const std::function<void(std::size_t)>& callback) {
    on_new_.set(*reader_, callback);
  }
  void clear_on_new_response_callback() { on_new_.clear(*reader_); }
  std::shared_ptr<rcl_client_t> get_client_handle() { return handle_; }
  bool service_is_ready() const;
  virtual std::shared_ptr<void> create_response() = 0;
  virtual void handle_response(std::shared_ptr<rmw_request_id_t> header,
                               std::shared_ptr<void> response) = 0;

 protected:
  void send(std::shared_ptr<const void> request, std::int64_t sequence_number);

  const std::uint64_t gid_;
};

template <typename Type>
class Client : public ClientBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Client)
  using Request = typename Type::Request;
  using Response = typename Type::Response;
  using SharedFuture = std::shared_future<std::shared_ptr<Response>>;
  using Function = std::function<void(SharedFuture)>;
  using ClientBase::ClientBase;

  SharedFuture async_send_request(std::shared_ptr<Request> request, Function function = {}) {
    std::int64_t number = 0;
    SharedFuture future;
    {
      const std::lock_guard lock{mutex_};
      number = ++sent_;
      Pending& pending = pending_[number];
      pending.function = std::move(function);
      future = pending.future = pending.promise.get_future().share();
    }
    send(std::make_shared<Request>(*request), number);
    return future;
  }
  std::shared_ptr<void> create_response() override { return std::make_shared<Response>(); }
  void handle_response(std::shared_ptr<rmw_request_id_t> header,
                       std::shared_ptr<void> response) override {
    Pending pending;
    {
      const std::lock_guard lock{mutex_};
      const auto found = pending_.find(header->sequence_number);
      if (found == pending_.end()) return;
      pending = std::move(found->second);
      pending_.erase(found);
    }
    pending.promise.set_value(std::static_pointer_cast<Response>(response));
    if (pending.function) pending.function(pending.future);
  }

 private:
  struct Pending {
    std::promise<std::shared_ptr<Response>> promise{};
    SharedFuture future{};
    Function function{};
  };
  void copy(const void* from, void* to) const override {
    *static_cast<Response*>(to) = *static_cast<const Response*>(from);
  }
  std::mutex mutex_;  // of what follows
  std::int64_t sent_ = 0;
  std::map<std::int64_t, Pending> pending_;
};

}  // namespace rclcpp
