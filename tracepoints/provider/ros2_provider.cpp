// The library of the profile `ros2`: how this project's objects and moments look in ROS 2's events.
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "ros2_provider.h"

#include <cie/tracepoints/ros2_profile.hpp>

#include "base/clock.hpp"
#include "ros2_profile.hpp"
#include "state.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <string>
#include <string_view>

#include <pthread.h>
#include <unistd.h>

namespace cie::trace {
namespace {

// Readers tell the distribution by it.
constexpr const char* kTracetoolsVersion = "8.2.2";
constexpr std::uint32_t kOneContext = 0;
constexpr std::int64_t kForever = -1;

using Gid = std::array<std::uint8_t, kRos2GidSize>;

Gid gid_of(std::uint64_t number) noexcept {
  Gid gid{};
  std::memcpy(gid.data(), &number, sizeof number);
  return gid;
}

// Read once: the hot path makes no system call. A child of fork() is another process.
std::atomic<std::uint32_t> own_pid{0};

void learn_pid() noexcept {
  own_pid.store(static_cast<std::uint32_t>(getpid()), std::memory_order_relaxed);
}

[[gnu::constructor]] void begin() noexcept {
  learn_pid();
  pthread_atfork(nullptr, nullptr, &learn_pid);
}

std::uint64_t handle(Ros2Object object, std::uint32_t id) noexcept {
  return ros2_handle(object, own_pid.load(std::memory_order_relaxed), id);
}

std::uint64_t handle(Ros2Object object, CallbackId callback) noexcept {
  return handle(object, to_number(callback));
}

std::uint64_t node_handle(NodeId node) noexcept {
  return node == kNoNode ? 0 : handle(Ros2Object::node, to_number(node));
}

// Unlike another one that is under way at the same time.
std::uint64_t message_handle(Ros2Object object, std::uint32_t id, std::uint64_t seq) noexcept {
  constexpr unsigned kSeqBits = 12;
  constexpr std::uint64_t kSeqMask = (1U << kSeqBits) - 1;
  return handle(object, id << kSeqBits | static_cast<std::uint32_t>(seq & kSeqMask));
}

// ROS 2 traces callbacks of these kinds; those of clients and waitables run unseen.
bool is_traced(CallbackKind kind) noexcept {
  return kind == CallbackKind::timer || kind == CallbackKind::subscription ||
         kind == CallbackKind::service;
}

bool is_enabled() noexcept {
  const lttng_ust_tracepoint* const events[] = {
      &lttng_ust_tracepoint_ros2___rcl_node_init,
      &lttng_ust_tracepoint_ros2___rclcpp_callback_register,
      &lttng_ust_tracepoint_ros2___callback_start, &lttng_ust_tracepoint_ros2___rcl_publish};
  for (const lttng_ust_tracepoint* event : events) {
    if (__atomic_load_n(&event->state, __ATOMIC_RELAXED) != 0) {
      return true;
    }
  }
  return false;
}

void run_begin() noexcept {
  lttng_ust_tracepoint(ros2, rcl_init, handle(Ros2Object::context, kOneContext),
                       kTracetoolsVersion);
}

// "/ns/name" is the name "name" in the namespace "/ns", "/name" in "/".
void node_init(NodeId node, const char* full_name) noexcept {
  const std::string_view full(full_name);
  const std::size_t slash = full.rfind('/');
  const bool has_slash = slash != std::string_view::npos;
  try {
    const std::string name_space(has_slash && slash > 0 ? full.substr(0, slash) : "/");
    lttng_ust_tracepoint(ros2, rcl_node_init, node_handle(node),
                         handle(Ros2Object::rmw_node, to_number(node)),
                         has_slash ? full_name + slash + 1 : full_name, name_space.c_str());
  } catch (const std::bad_alloc&) {
    // Without memory for the namespace the node stays unnamed, as if the event had been discarded.
  }
}

void timer_init(CallbackId id, const CallbackInfo& info) noexcept {
  const std::uint64_t timer = handle(Ros2Object::timer, id);
  lttng_ust_tracepoint(ros2, rcl_timer_init, timer, static_cast<std::int64_t>(info.period_ns));
  lttng_ust_tracepoint(ros2, rclcpp_timer_callback_added, timer, handle(Ros2Object::callback, id));
  lttng_ust_tracepoint(ros2, rclcpp_timer_link_node, timer, node_handle(info.node));
}

void subscription_init(CallbackId id, const CallbackInfo& info) noexcept {
  const std::uint64_t subscription = handle(Ros2Object::subscription, id);
  const std::uint64_t object = handle(Ros2Object::subscription_object, id);
  const std::uint64_t rmw = handle(Ros2Object::rmw_subscription, id);
  const Gid gid = gid_of(rmw);
  lttng_ust_tracepoint(ros2, rmw_subscription_init, rmw, gid.data());
  lttng_ust_tracepoint(ros2, rcl_subscription_init, subscription, node_handle(info.node), rmw,
                       info.source.c_str(), std::uint64_t{info.queue_depth});
  lttng_ust_tracepoint(ros2, rclcpp_subscription_init, subscription, object);
  lttng_ust_tracepoint(ros2, rclcpp_subscription_callback_added, object,
                       handle(Ros2Object::callback, id));
}

void callback_init(const CallbackState& callback) noexcept {
  const CallbackInfo& info = callback.info;
  const CallbackId id = callback.id;
  switch (info.kind) {
    case CallbackKind::timer:
      timer_init(id, info);
      break;
    case CallbackKind::subscription:
      subscription_init(id, info);
      break;
    case CallbackKind::service:
      lttng_ust_tracepoint(ros2, rcl_service_init, handle(Ros2Object::service, id),
                           node_handle(info.node), handle(Ros2Object::rmw_service, id),
                           info.source.c_str());
      lttng_ust_tracepoint(ros2, rclcpp_service_callback_added, handle(Ros2Object::service, id),
                           handle(Ros2Object::callback, id));
      break;
    case CallbackKind::client:
      lttng_ust_tracepoint(ros2, rcl_client_init, handle(Ros2Object::client, id),
                           node_handle(info.node), handle(Ros2Object::rmw_client, id),
                           info.source.c_str());
      return;
    case CallbackKind::waitable:
      return;
  }
  lttng_ust_tracepoint(ros2, rclcpp_callback_register, handle(Ros2Object::callback, id),
                       info.symbol.c_str());
}

void publisher_init(const PublisherState& publisher) noexcept {
  const std::uint32_t id = to_number(publisher.id);
  const std::uint64_t rmw = handle(Ros2Object::rmw_publisher, id);
  const Gid gid = gid_of(publisher.writer_gid);
  lttng_ust_tracepoint(ros2, rmw_publisher_init, rmw, gid.data());
  lttng_ust_tracepoint(ros2, rcl_publisher_init, handle(Ros2Object::publisher, id),
                       node_handle(publisher.node), rmw, publisher.topic.c_str(),
                       std::uint64_t{publisher.queue_depth});
}

void take(CallbackId id, std::uint64_t seq, std::int64_t source_timestamp) noexcept {
  const std::uint64_t message = message_handle(Ros2Object::taken_message, to_number(id), seq);
  lttng_ust_tracepoint(ros2, rmw_take, handle(Ros2Object::rmw_subscription, id), message,
                       source_timestamp, 1);
  lttng_ust_tracepoint(ros2, rcl_take, message);
  lttng_ust_tracepoint(ros2, rclcpp_take, message);
}

void callback_start(const CallbackState& callback, std::uint64_t seq,
                    const Callback::Release& release) noexcept {
  const CallbackKind kind = callback.info.kind;
  if (!is_traced(kind)) {
    return;
  }
  if (kind == CallbackKind::timer) {
    lttng_ust_tracepoint(ros2, rclcpp_executor_execute, handle(Ros2Object::timer, callback.id));
  } else if (kind == CallbackKind::subscription) {
    lttng_ust_tracepoint(ros2, rclcpp_executor_execute,
                         handle(Ros2Object::subscription, callback.id));
    take(callback.id, seq, release.source_timestamp_realtime_ns);
  }
  lttng_ust_tracepoint(ros2, callback_start, handle(Ros2Object::callback, callback.id), 0);
}

void callback_end(const CallbackState& callback) noexcept {
  if (is_traced(callback.info.kind)) {
    lttng_ust_tracepoint(ros2, callback_end, handle(Ros2Object::callback, callback.id));
  }
}

void publish(PublisherId publisher, std::uint64_t seq,
             std::int64_t source_timestamp_realtime_ns) noexcept {
  const std::uint32_t id = to_number(publisher);
  const std::uint64_t message = message_handle(Ros2Object::sent_message, id, seq);
  lttng_ust_tracepoint(ros2, rclcpp_publish, message);
  lttng_ust_tracepoint(ros2, rcl_publish, handle(Ros2Object::publisher, id), message);
  lttng_ust_tracepoint(ros2, rmw_publish, handle(Ros2Object::rmw_publisher, id), message,
                       source_timestamp_realtime_ns);
}

void before_wait(std::int64_t deadline_ns) noexcept {
  std::int64_t timeout = kForever;
  if (deadline_ns != kWaitForever) {
    timeout = std::max(deadline_ns - now_ns(CLOCK_MONOTONIC), std::int64_t{0});
  }
  lttng_ust_tracepoint(ros2, rclcpp_executor_wait_for_work, timeout);
}

void after_wait() noexcept { lttng_ust_tracepoint(ros2, rclcpp_executor_get_next_ready); }

}  // namespace
}  // namespace cie::trace

// Found by its name (dlsym). NOLINTNEXTLINE(readability-identifier-naming)
extern "C" [[gnu::visibility("default")]] const cie::trace::Ros2Profile cie_ros2_profile{
    .is_enabled = &cie::trace::is_enabled,
    .run_begin = &cie::trace::run_begin,
    .node_init = &cie::trace::node_init,
    .callback_init = &cie::trace::callback_init,
    .publisher_init = &cie::trace::publisher_init,
    .callback_start = &cie::trace::callback_start,
    .callback_end = &cie::trace::callback_end,
    .publish = &cie::trace::publish,
    .before_wait = &cie::trace::before_wait,
    .after_wait = &cie::trace::after_wait};
