// Addresses as users write them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace cie {

struct NetworkAddress {
  std::string host;  // name or number; of IPv6 without brackets
  std::uint16_t port = 0;

  // "HOST:PORT", of IPv6 "[HOST]:PORT".
  std::string text() const;
  // The same as LTTng wants it, "tcp://HOST:PORT" or "tcp6://[HOST]:PORT". A name is IPv4's.
  std::string url() const;

  bool operator==(const NetworkAddress&) const = default;
};

// "HOST", "HOST:PORT", "[HOST]:PORT". Without a default port one has to be there. Empty: none of
// these.
std::optional<NetworkAddress> parse_address(std::string_view text,
                                            std::optional<std::uint16_t> default_port);
// Where somebody listens: the same, or "PORT" alone, which is one of 127.0.0.1.
std::optional<NetworkAddress> parse_listen_address(std::string_view text,
                                                   std::optional<std::uint16_t> default_port);

}  // namespace cie
