#include "lttng/relay_link.hpp"

#include "system/error.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;

constexpr const char* kLttngTimeout = "LTTNG_NETWORK_SOCKET_TIMEOUT";  // in ms
constexpr milliseconds kLttngPatience{10'000};
constexpr milliseconds kLeastPatience{1000};
constexpr milliseconds kConnectPatience{5000};

// Whoever set it for LTTng knows their network.
milliseconds network_patience() {
  const char* text = std::getenv(kLttngTimeout);
  const milliseconds chosen{text == nullptr ? 0 : std::strtol(text, nullptr, 10)};
  if (chosen.count() > 0) return std::max(chosen, kLeastPatience);
  setenv(kLttngTimeout, std::to_string(kLttngPatience.count()).c_str(), 1);
  return kLttngPatience;
}

void set_option(int socket, int level, int option, int value) noexcept {
  // Without these a dead network is noticed later: worse, not wrong.
  static_cast<void>(setsockopt(socket, level, option, &value, sizeof value));
}

// TCP asks every second whether the peer is there, and gives up after `patience`.
void notice_silence(int socket, milliseconds patience) noexcept {
  const auto seconds = static_cast<int>(std::chrono::ceil<std::chrono::seconds>(patience).count());
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, seconds);
  set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, static_cast<int>(patience.count()));
}

}  // namespace

RelayLink::RelayLink(const NetworkAddress& address)
    : address_(address), peer_(address), patience_(network_patience()) {
  const auto error = try_to_connect(kConnectPatience);
  if (!error.empty()) {
    throw RecordError("no relay daemon answers at " + address_.text() + ": " + error +
                      " (cie collect starts one there)");
  }
}

std::string RelayLink::data_url() const {
  NetworkAddress data = peer_;
  ++data.port;
  return data.url();
}

std::string RelayLink::try_to_connect(milliseconds patience) {
  auto connection = connect_to(address_, patience);
  if (connection.socket.is_open()) {
    notice_silence(connection.socket.get(), patience_);
    peer_ = std::move(connection.peer);
  }
  socket_ = std::move(connection.socket);
  return connection.error;
}

bool RelayLink::is_connected() noexcept {
  if (!socket_.is_open()) return false;
  // A relay daemon sends nothing unasked: whatever can be read is the end of the connection.
  pollfd descriptor{.fd = socket_.get(), .events = POLLIN, .revents = 0};
  if (poll(&descriptor, 1, 0) > 0) socket_.close();
  return socket_.is_open();
}

bool RelayLink::reconnect(milliseconds patience) { return try_to_connect(patience).empty(); }

}  // namespace cie::record
