// QoS in the terms of DDS.
#pragma once

#include <cie/executor/qos.hpp>

#include <memory>
#include <string_view>

#include <dds/dds.h>

namespace cie::executor::dds {

struct DeleteQos {
  void operator()(dds_qos_t* qos) const noexcept { dds_delete_qos(qos); }
};
using QosPtr = std::unique_ptr<dds_qos_t, DeleteQos>;

// The policies that rmw_cyclonedds sets for the same QoS: disposal is left to the application,
// transient-local history is as deep as the queue. One differs: there a reliable writer blocks for
// ever rather than drops.
// `user_data` travels with the discovery of the entity. Throws std::logic_error naming `object` for
// KeepLast{0} and durations that are not positive.
QosPtr to_dds(const QoS& qos, std::string_view object, std::string_view user_data = {});

}  // namespace cie::executor::dds
