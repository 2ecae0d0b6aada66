// Answers requests. Made by Node::create_service.
#pragma once

#include <cie/executor/callback_handle.hpp>
#include <cie/executor/message.hpp>

#include <concepts>
#include <cstdint>
#include <functional>

namespace cie {

// A request or a response, declared in IDL as in ROS 2:
//
//   struct Add_Request { int64 a; int64 b; };
//   struct Add_Response { int64 sum; };
//
// Whose call it belongs to stands before it on the wire, as rmw_cyclonedds does it, and is none of
// the user's affair: a struct that itself begins with that header is refused.
template <typename T>
concept CarriesCallHeader = requires(T message) {
  { message.header.guid } -> std::same_as<std::uint64_t&>;
  { message.header.seq } -> std::same_as<std::int64_t&>;
};
template <typename T>
concept ServiceMessage = Message<T> && !CarriesCallHeader<T>;

// What a service's callback looks like: it fills in the response, which is empty when it is called.
template <typename F, typename Request, typename Response>
concept ServiceFunction = std::invocable<F&, const Request&, Response&>;

namespace executor {
class ServiceCallback;
using ErasedServiceFunction = std::function<void(const void* request, void* response)>;
std::uint32_t matched_writers(const ServiceCallback& callback);
}  // namespace executor

// The response leaves when the callback has returned, from its thread; to a client whose reader is
// not discovered yet, when it is, between two instances. As many wait as the queue of requests is
// deep; the oldest make room. A callback that throws sends no response, and one that cannot be sent
// within the QoS's max_blocking_time is lost: its client times out. It ends with the last copy of its
// handle. That may outlive the node; it then is idle.
template <ServiceMessage Request, ServiceMessage Response>
class Service : public executor::CallbackHandle<executor::ServiceCallback> {
 public:
  using CallbackHandle::CallbackHandle;
  // Clients connected now, in this process and others.
  std::uint32_t client_count() const { return executor::matched_writers(*callback_); }
};

}  // namespace cie
