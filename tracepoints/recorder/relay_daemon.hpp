// A relay daemon of LTTng for one live session, on loopback ports of its own.
#pragma once

#include "child_process.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cie::record {

class RelayDaemon {
 public:
  // Starts lttng-relayd, which ends with this process however that goes. It keeps what it receives
  // in a temporary directory (the session's trace files bound how much). Throws RecordError.
  RelayDaemon();
  ~RelayDaemon();
  RelayDaemon(const RelayDaemon&) = delete;
  RelayDaemon& operator=(const RelayDaemon&) = delete;

  bool is_alive() { return process_ && !process_->poll(); }
  std::string control_url() const { return address("tcp", control_port_); }
  std::string data_url() const { return address("tcp", data_port_); }
  // What a reader connects to.
  std::string live_url() const { return address("net", live_port_); }

 private:
  static std::string address(const char* protocol, std::uint16_t port);
  // False if another program took one of the ports in between.
  bool start();
  void stop() noexcept;

  std::filesystem::path directory_;
  std::optional<ChildProcess> process_;
  std::uint16_t control_port_ = 0;
  std::uint16_t data_port_ = 0;
  std::uint16_t live_port_ = 0;
};

}  // namespace cie::record
