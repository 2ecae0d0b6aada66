// Calls a service. Made by Node::create_client.
#pragma once

#include <cie/executor/callback_group.hpp>
#include <cie/executor/callback_handle.hpp>
#include <cie/executor/message.hpp>
#include <cie/executor/service.hpp>

#include <chrono>
#include <concepts>
#include <cstddef>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

namespace cie {

// No response came in time.
class ServiceTimeout : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ClientOptions {
  // As in CallbackOptions.
  std::shared_ptr<CallbackGroup> group{};
  std::string name{};
  std::chrono::nanoseconds deadline{0};
  // How long a request may wait for its response. 0: for ever, and it is remembered that long.
  std::chrono::nanoseconds timeout{0};
};

namespace executor {
class ClientCallback;
// `response` is null when the request timed out.
using Completion = std::function<void(const std::shared_ptr<const void>& response)>;
void send_request(ClientCallback& client, const void* request, Completion completion);
const std::string& service_of(const ClientCallback& client) noexcept;
bool is_ready(const ClientCallback& client);
bool wait_until_ready(const ClientCallback& client, std::chrono::nanoseconds timeout);
std::size_t pending_requests(const ClientCallback& client);
}  // namespace executor

// A response is an instance of the client's callback: it runs on the client's thread, released by
// the arrival of that very response. So is a timeout, released when it was due. Responses to other
// clients never wake it. Both need an executor that serves the client's node.
//
// Thread-safe. It ends with the last copy of its handle, or with its node, which a handle may
// outlive. What is pending then never completes: its future breaks, its callback is dropped.
template <ServiceMessage Request, ServiceMessage Response>
class Client : public executor::CallbackHandle<executor::ClientCallback> {
 public:
  using ResponsePtr = std::shared_ptr<const Response>;

  using CallbackHandle::CallbackHandle;

  // Sends the request and returns without waiting. The future gets the
  // response, or throws ServiceTimeout. Waiting for it inside a callback works where the client has
  // another thread, as under the isolated executor; on one thread it would wait for ever. Throws
  // std::runtime_error when DDS refuses the request, or it cannot be sent within the QoS's
  // max_blocking_time.
  std::future<ResponsePtr> async_send_request(const Request& request) {
    auto promise = std::make_shared<std::promise<ResponsePtr>>();
    auto future = promise->get_future();
    executor::send_request(
        *callback_, &request,
        [promise, service = service_name()](const std::shared_ptr<const void>& response) {
          if (response) {
            promise->set_value(std::static_pointer_cast<const Response>(response));
          } else {
            promise->set_exception(std::make_exception_ptr(
                ServiceTimeout{"no response of service \"" + service + "\" came in time"}));
          }
        });
    return future;
  }

  // Likewise; `function` is called with the response, or with null when it did not come in time.
  template <std::invocable<ResponsePtr> F>
  void async_send_request(const Request& request, F function) {
    executor::send_request(
        *callback_, &request,
        [function = std::move(function)](const std::shared_ptr<const void>& response) mutable {
          function(std::static_pointer_cast<const Response>(response));
        });
  }

  // Whether a service is there that can hear this client and be heard by it.
  bool service_is_ready() const { return executor::is_ready(*callback_); }
  // Waits for that; false if it took longer. Not for a real-time callback: it polls.
  bool wait_for_service(std::chrono::nanoseconds timeout) const {
    return executor::wait_until_ready(*callback_, timeout);
  }
  // Requests without response or timeout so far.
  std::size_t pending_requests() const { return executor::pending_requests(*callback_); }

  const std::string& service_name() const noexcept { return executor::service_of(*callback_); }
};

}  // namespace cie
