// How the two ends of a service know each other, as rmw_cyclonedds does it.
#pragma once

#include "service_clients.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

// The value of `key` in an endpoint's user data, "key=value;key=value;"; empty if there is none.
std::optional<std::string> value_of(std::string_view key, std::string_view user_data);

// The clients whose requests `request_reader` gets, and whether `reply_writer` is connected to the
// reader that has the same "clientid". Allocates.
std::vector<ServiceClients::Client> clients_of(dds_entity_t request_reader,
                                               dds_entity_t reply_writer);

}  // namespace cie::executor
