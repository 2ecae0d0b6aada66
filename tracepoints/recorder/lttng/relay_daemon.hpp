// A relay daemon of LTTng of our own.
#pragma once

#include "system/child_process.hpp"
#include "system/connection.hpp"
#include "system/temporary_directory.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace cie::record {

class RelayDaemon {
 public:
  // On free loopback ports, for one live session: what it receives is kept in a temporary directory
  // (the session's trace files bound how much). Throws RecordError.
  RelayDaemon();
  // Listens on three ports that follow each other, for control, data and live readers; port 0: any
  // three. What it receives is kept below `output`. Throws RecordError.
  RelayDaemon(const NetworkAddress& address, const std::filesystem::path& output);
  ~RelayDaemon();
  RelayDaemon(const RelayDaemon&) = delete;
  RelayDaemon& operator=(const RelayDaemon&) = delete;

  // It ends with this process, however that goes.
  bool is_alive() { return process_ && !process_->poll(); }
  // "it exited with status 1: " and what it said last, as far as there is any.
  std::string how_it_ended();

  NetworkAddress control() const { return address_; }
  std::string control_url() const { return address_.url(); }
  std::string data_url() const { return next(1).url(); }
  // What a reader connects to.
  std::string live_url() const { return "net://" + next(2).text(); }

  void stop() noexcept;

 private:
  void start_somewhere();
  std::string last_words() const;
  // False if another program took one of the ports in between.
  bool start();
  NetworkAddress next(std::uint16_t step) const;

  std::optional<TemporaryDirectory> directory_;
  std::filesystem::path output_;
  NetworkAddress address_;
  std::optional<ChildProcess> process_;
};

}  // namespace cie::record
