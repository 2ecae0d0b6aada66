// What a request or a response is on the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <dds/dds.h>

namespace cie::executor {

// In memory and on the wire: the header that rmw_cyclonedds puts first (CallHeader), then the
// user's struct as its IDL declares it. Made from what idlc generated for that; must outlive the
// making of topics with it only.
class ServiceType {
 public:
  explicit ServiceType(const dds_topic_descriptor& payload);
  ServiceType(const ServiceType&) = delete;
  ServiceType& operator=(const ServiceType&) = delete;
  const dds_topic_descriptor& descriptor() const noexcept { return descriptor_; }

 private:
  std::vector<std::uint32_t> operations_;
  dds_topic_descriptor descriptor_;
};

// The user's struct in a message of such a type.
void* payload_of(void* message) noexcept;
const void* payload_of(const void* message) noexcept;

}  // namespace cie::executor
