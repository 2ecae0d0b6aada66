// How the two ends of a service know each other, as rmw_cyclonedds does it.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include <dds/dds.h>

namespace cie::executor {

// Stands first in every request and response: who asked, and which of its requests.
struct CallHeader {
  std::uint64_t guid = 0;
  std::int64_t seq = 0;
};
static_assert(sizeof(CallHeader) == 16);

inline CallHeader header_of(const void* message) noexcept {
  CallHeader header;
  std::memcpy(&header, message, sizeof header);
  return header;
}
inline void set_header(void* message, const CallHeader& header) noexcept {
  std::memcpy(message, &header, sizeof header);
}

// Random identity of a client or of a service. Both its DDS endpoints carry it as user data,
// "clientid=01.02. … ;" or "serviceid=…;", so that each end can tell which belong together.
class EndpointId {
 public:
  EndpointId();  // throws std::system_error when the kernel has no random numbers
  // The header's guid of a client: the first half.
  std::uint64_t guid() const noexcept;
  std::string user_data(std::string_view key) const;

 private:
  std::array<unsigned char, 16> bytes_{};
};

// The guid in "clientid=…;" of an endpoint's user data; empty if there is none.
std::optional<std::uint64_t> client_guid(std::string_view user_data) noexcept;

// Whether the reply reader of this client is connected to `writer`. Allocates.
bool has_client(dds_entity_t writer, std::uint64_t guid);

}  // namespace cie::executor
