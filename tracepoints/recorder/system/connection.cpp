#include "system/connection.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

namespace cie::record {
namespace {

// 0, or an errno.
int connect_within(int socket, const addrinfo& to, std::chrono::milliseconds patience) {
  if (connect(socket, to.ai_addr, to.ai_addrlen) == 0) return 0;
  if (errno != EINPROGRESS) return errno;
  pollfd descriptor{.fd = socket, .events = POLLOUT, .revents = 0};
  int ready = 0;
  do {
    ready = poll(&descriptor, 1, static_cast<int>(patience.count()));
  } while (ready < 0 && errno == EINTR);
  if (ready <= 0) return ready == 0 ? ETIMEDOUT : errno;
  int error = 0;
  socklen_t size = sizeof error;
  return getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

std::string numeric_host(const addrinfo& address) {
  std::array<char, NI_MAXHOST> text{};
  const int failed = getnameinfo(address.ai_addr, address.ai_addrlen, text.data(), text.size(),
                                 nullptr, 0, NI_NUMERICHOST);
  return failed != 0 ? "" : text.data();
}

}  // namespace

FoundAddresses look_up(const NetworkAddress& address, int flags) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags;
  addrinfo* list = nullptr;
  const int failed =
      getaddrinfo(address.host.c_str(), std::to_string(address.port).c_str(), &hints, &list);
  if (failed != 0) return {.list = nullptr, .error = gai_strerror(failed)};
  return {.list = std::unique_ptr<addrinfo, FreeAddresses>(list), .error = {}};
}

Connection connect_to(const NetworkAddress& address, std::chrono::milliseconds patience) {
  const auto found = look_up(address, 0);
  Connection result{.socket = {}, .peer = address, .error = found.error};
  for (const addrinfo* each = found.list.get(); each != nullptr; each = each->ai_next) {
    FileDescriptor socket(
        ::socket(each->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, each->ai_protocol));
    const int error = socket.is_open() ? connect_within(socket.get(), *each, patience) : errno;
    if (error == 0) {
      result.socket = std::move(socket);
      result.peer.host = numeric_host(*each);
      result.error.clear();
      return result;
    }
    result.error = std::strerror(error);
  }
  return result;
}

}  // namespace cie::record
