// Rules for the HTTP servers of this program.
#pragma once

#include <string>

#include <fmt/format.h>
#include <httplib.h>
#include <sys/socket.h>

namespace cie::viewer_export {

// For httplib::Server::set_socket_options. SO_REUSEADDR only: httplib's default would let a second
// one take the same port.
inline void use_port_alone(int socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

// Whether the request calls this server, which listens on a loopback address (`host`, as in a URL),
// by that address: another site's name may lead here, too.
inline bool is_called_by_loopback(const httplib::Request& request, const std::string& host,
                                  int port) {
  const auto called = request.get_header_value("Host");
  return called == fmt::format("{}:{}", host, port) || called == fmt::format("localhost:{}", port);
}

}  // namespace cie::viewer_export
