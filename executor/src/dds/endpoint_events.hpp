// What DDS notices of a reader or writer besides samples.
#pragma once

#include <cie/executor/event_callbacks.hpp>

#include <cstdint>
#include <functional>
#include <memory>

#include <dds/dds.h>

namespace cie::executor {

// Who is told, on the thread in which DDS notices; what is empty is nobody. Nothing of DDS may be
// called there.
struct EndpointEvents {
  std::function<void()> deadline_missed{};
  std::function<void()> liveliness{};  // of a reader's writers: changed; of a writer: lost
  std::function<void()> matched{};
  std::function<void(QosPolicyKind)> incompatible_qos{};
  std::function<void(std::uint32_t count)> message_lost{};  // told by the reader's Delivery
};

struct DeleteListener {
  void operator()(dds_listener_t* listener) const noexcept { dds_delete_listener(listener); }
};
using ListenerPtr = std::unique_ptr<dds_listener_t, DeleteListener>;

// For all but lost messages. `events` must outlive the entity that gets the listener.
ListenerPtr reader_listener(const EndpointEvents& events);
ListenerPtr writer_listener(const EndpointEvents& events);

QosPolicyKind policy_kind(std::uint32_t dds_policy_id) noexcept;

}  // namespace cie::executor
