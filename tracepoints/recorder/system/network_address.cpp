#include "system/network_address.hpp"

#include "system/error.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>

#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

namespace cie::record {
namespace {

bool is_ipv6(const std::string& host) { return host.find(':') != std::string::npos; }

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

std::string NetworkAddress::text() const {
  return is_ipv6(host) ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

std::string NetworkAddress::url() const { return (is_ipv6(host) ? "tcp6://" : "tcp://") + text(); }

NetworkAddress parse_address(std::string_view option, std::string_view text,
                             std::uint16_t default_port) {
  NetworkAddress address{.host = std::string(text), .port = default_port};
  const bool is_bracketed = text.starts_with('[');
  const auto end_of_host = is_bracketed ? text.find(']') : text.rfind(':');
  std::string_view port;
  bool is_valid = true;
  if (is_bracketed) {
    is_valid = end_of_host != std::string_view::npos;
    address.host = text.substr(1, is_valid ? end_of_host - 1 : 0);
    if (is_valid) port = text.substr(end_of_host + 1);
    is_valid = is_valid && (port.empty() || port.starts_with(':'));
  } else if (end_of_host != std::string_view::npos && text.find(':') == end_of_host) {
    address.host = text.substr(0, end_of_host);
    port = text.substr(end_of_host);
  }
  if (is_valid && !port.empty()) {
    port.remove_prefix(1);
    const auto [rest, error] =
        std::from_chars(port.data(), port.data() + port.size(), address.port);
    is_valid = error == std::errc{} && rest == port.data() + port.size() && !port.empty();
  }
  const bool is_plain = address.host.find_first_of("/@ \t\n") == std::string::npos;
  if (!is_valid || address.host.empty() || !is_plain) {
    throw UsageError(std::string(option) + " takes HOST or HOST:PORT, of IPv6 [HOST]:PORT: \"" +
                     std::string(text) + '"');
  }
  return address;
}

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
