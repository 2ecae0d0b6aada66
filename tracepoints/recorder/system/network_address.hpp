// Where a relay daemon listens: addresses as users write them, and connections to them.
#pragma once

#include "base/file_descriptor.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <netdb.h>

namespace cie::record {

// LTTng's own ports. Of one relay daemon they follow each other: control, data, live.
inline constexpr std::uint16_t kRelayPort = 5342;

struct NetworkAddress {
  std::string host;  // name or number; of IPv6 without brackets
  std::uint16_t port = 0;

  // "HOST:PORT", of IPv6 "[HOST]:PORT".
  std::string text() const;
  // The same as LTTng wants it, "tcp://HOST:PORT" or "tcp6://[HOST]:PORT". A name is IPv4's.
  std::string url() const;
};

// "HOST", "HOST:PORT", "[HOST]:PORT". Throws UsageError, naming `option`.
NetworkAddress parse_address(std::string_view option, std::string_view text,
                             std::uint16_t default_port);

struct FreeAddresses {
  void operator()(addrinfo* list) const noexcept { freeaddrinfo(list); }
};

// What a name stands for: at least one address, or an error's words.
struct FoundAddresses {
  std::unique_ptr<addrinfo, FreeAddresses> list;
  std::string error;
};

// Addresses for streams. `flags` are those of getaddrinfo. Never throws for a name that nobody knows.
FoundAddresses look_up(const NetworkAddress& address, int flags);

// A connection, and the numeric address that it leads to.
struct Connection {
  FileDescriptor socket;
  NetworkAddress peer;
  std::string error;  // why there is none; empty if there is one
};

// Tries every address of the host, each for `patience` at most. Never throws: a peer that does not
// answer is no surprise.
Connection connect_to(const NetworkAddress& address, std::chrono::milliseconds patience);

}  // namespace cie::record
