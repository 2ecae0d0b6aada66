// Connections to where a relay daemon listens.
#pragma once

#include "base/file_descriptor.hpp"
#include "base/network_address.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include <netdb.h>

namespace cie::record {

// LTTng's own ports. Of one relay daemon they follow each other: control, data, live.
inline constexpr std::uint16_t kRelayPort = 5342;

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
