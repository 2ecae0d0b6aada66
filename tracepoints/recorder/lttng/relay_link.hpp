// Whether the relay daemon that a recording is streamed to is still there.
#pragma once

#include "base/file_descriptor.hpp"
#include "system/connection.hpp"

#include <chrono>
#include <string>

namespace cie::record {

// LTTng says nothing of a connection that broke before a session is destroyed. So this holds a
// connection of its own to the relay daemon, on which nothing is sent: it ends when the daemon
// does, and some seconds after the network does.
class RelayLink {
 public:
  // Connects. LTTng's daemons that are started later then give up a silent connection, too, rather
  // than wait for as long as TCP does. Throws RecordError if no relay daemon answers.
  explicit RelayLink(const NetworkAddress& address);

  // Where LTTng is to send to: numbers, because it resolves names otherwise than we do.
  std::string control_url() const { return peer_.url(); }
  std::string data_url() const;
  const NetworkAddress& address() const noexcept { return address_; }
  // How long LTTng and this wait for a network that is silent.
  std::chrono::milliseconds patience() const noexcept { return patience_; }

  // Never blocks.
  bool is_connected() noexcept;
  // Waits for `patience` at most. False: nobody answers.
  bool reconnect(std::chrono::milliseconds patience);

 private:
  std::string try_to_connect(std::chrono::milliseconds patience);

  NetworkAddress address_;
  NetworkAddress peer_;
  std::chrono::milliseconds patience_;
  FileDescriptor socket_;
};

}  // namespace cie::record
