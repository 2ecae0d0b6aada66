// Serves snapshots over HTTP: a page that follows them, and metrics for Prometheus.
#pragma once

#include "metrics.hpp"
#include "snapshot.hpp"

#include <cstdint>
#include <memory>
#include <string>

namespace cie::live {

//   /          the page         /events        snapshots as they come (server-sent events)
//   /metrics   for Prometheus   /snapshot.json the last one
// On a loopback address it answers only those who call it by that (see HttpServer). Elsewhere it
// answers everybody, and nothing is encrypted.
class LiveServer {
 public:
  // Port 0: any free one. Serves from now on, by threads of its own. Throws std::runtime_error.
  LiveServer(const std::string& address, std::uint16_t port);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  // "http://127.0.0.1:9464/"
  std::string url() const;
  // Whether only this machine reaches it.
  bool is_loopback() const;
  // From one thread.
  void publish(const Snapshot& snapshot);

 private:
  struct Server;
  std::unique_ptr<Server> server_;
};

}  // namespace cie::live
