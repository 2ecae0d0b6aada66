#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include <rcl/service.h>
#include <rclcpp/double_callback.hpp>
#include <rclcpp/macros.hpp>
#include <rclcpp/qos.hpp>
#include <rclcpp/version.h>
#include <rmw_double/bus.hpp>

namespace rclcpp {

// What services and clients share: a queue of requests or of responses. `Handle` is rcl's.
template <typename Handle>
class ServiceEnd {
 public:
  ServiceEnd(std::string name, const rmw_qos_profile_t& profile)
      : name_(std::move(name)),
        reader_(std::make_shared<rmw_double::Reader>(profile)),
        handle_(std::make_shared<Handle>(reader_)) {
    handle_->copy = [this](const void* from, void* to) { copy(from, to); };
  }
  ServiceEnd(const ServiceEnd&) = delete;
  ServiceEnd& operator=(const ServiceEnd&) = delete;
  virtual ~ServiceEnd() {
#if RCLCPP_VERSION_MAJOR < 28
    on_new_.clear(*reader_);
#endif
  }
  std::shared_ptr<rmw_request_id_t> create_request_header() {
    return std::make_shared<rmw_request_id_t>();
  }

 protected:
  void listen(const std::string& topic) {
    rmw_double::Bus::get().join(topic,
                                {.owner = reader_, .reader = reader_, .qos = reader_->qos()});
  }
  virtual void copy(const void* from, void* to) const = 0;

  const std::string name_;
  OnNewCallback on_new_;  // goes after its owner's hold on the handle, whoever else has one
  const std::shared_ptr<rmw_double::Reader> reader_;
  const std::shared_ptr<Handle> handle_;
};

class ServiceBase : public ServiceEnd<rcl_service_t> {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(ServiceBase)
  ServiceBase(const std::string& name, const rmw_qos_profile_t& profile)
      : ServiceEnd(name, profile) {
    listen("request " + name);
  }
  // rcl's handle has it: rclcpp reads what has been freed where this throws.
  const char* get_service_name() const {
    if (handle_->has_ended) throw std::logic_error{"the name of a service that has ended"};
    return name_.c_str();
  }
  QoS get_request_subscription_actual_qos() const { return QoS{reader_->qos()}; }
  void set_on_new_request_callback(const std::function<void(std::size_t)>& callback) {
    on_new_.set(*reader_, callback);
  }
  void clear_on_new_request_callback() { on_new_.clear(*reader_); }
  // Of the double alone: somebody is called at a new request.
  bool has_on_new_request_callback() { return on_new_.is_set(); }
  std::shared_ptr<rcl_service_t> get_service_handle() { return handle_; }
  virtual std::shared_ptr<void> create_request() = 0;
  virtual void handle_request(std::shared_ptr<rmw_request_id_t> header,
                              std::shared_ptr<void> request) = 0;

 protected:
  void respond(const rmw_request_id_t& header, std::shared_ptr<const void> response);
};

template <typename Type>
class Service : public ServiceBase {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Service)
  using Request = typename Type::Request;
  using Response = typename Type::Response;
  using Function = std::function<void(std::shared_ptr<Request>, std::shared_ptr<Response>)>;
  Service(const std::string& name, const rmw_qos_profile_t& profile, Function function)
      : ServiceBase(name, profile), function_(std::move(function)) {}
  std::shared_ptr<void> create_request() override { return std::make_shared<Request>(); }
  void handle_request(std::shared_ptr<rmw_request_id_t> header,
                      std::shared_ptr<void> request) override {
    auto response = std::make_shared<Response>();
    function_(std::static_pointer_cast<Request>(request), response);
    respond(*header, response);
  }

 private:
  void copy(const void* from, void* to) const override {
    *static_cast<Request*>(to) = *static_cast<const Request*>(from);
  }
  Function function_;
};

}  // namespace rclcpp
