// What several machines send to this one, into one directory.
#pragma once

#include "lttng/relay_daemon.hpp"
#include "system/connection.hpp"
#include "system/signals.hpp"

#include <filesystem>
#include <memory>
#include <set>
#include <string>

namespace cie::record {

struct CollectOptions {
  std::filesystem::path directory;                                 // absolute
  NetworkAddress listen{.host = "127.0.0.1", .port = kRelayPort};  // port 0: any three
};

class Collection {
 public:
  // Creates the directory and starts the relay daemon. A directory that is there already is
  // continued: sessions have names of their own. Throws RecordError.
  explicit Collection(const CollectOptions& options);

  // Until a signal; tells of hosts on standard error as they come. Throws RecordError if the relay
  // daemon ends, or no space was left for what came.
  void run();

 private:
  std::set<std::filesystem::path> sessions() const;
  void tell_of_new_sessions();
  void look_at_space();
  std::string no_space() const;
  void print_summary() const;

  CollectOptions options_;
  Signals signals_;
  std::unique_ptr<RelayDaemon> relay_;
  std::set<std::filesystem::path> before_;  // of another run
  std::set<std::filesystem::path> known_;
  bool had_no_space_ = false;  // at some time
};

}  // namespace cie::record
