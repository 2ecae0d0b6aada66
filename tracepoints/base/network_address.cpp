#include "base/network_address.hpp"

#include "base/text.hpp"

#include <fmt/format.h>

namespace cie {
namespace {

constexpr const char* kLoopback = "127.0.0.1";

bool is_ipv6(const std::string& host) { return host.find(':') != std::string::npos; }

}  // namespace

std::string NetworkAddress::text() const {
  return is_ipv6(host) ? fmt::format("[{}]:{}", host, port) : fmt::format("{}:{}", host, port);
}

std::string NetworkAddress::url() const { return (is_ipv6(host) ? "tcp6://" : "tcp://") + text(); }

std::optional<NetworkAddress> parse_address(std::string_view text,
                                            std::optional<std::uint16_t> default_port) {
  constexpr auto kNone = std::string_view::npos;
  std::string_view host = text;
  std::optional<std::string_view> port;
  if (text.starts_with('[')) {
    const auto end = text.find(']');
    if (end == kNone) return std::nullopt;
    host = text.substr(1, end - 1);
    const auto rest = text.substr(end + 1);
    if (!rest.empty() && rest.front() != ':') return std::nullopt;
    if (!rest.empty()) port = rest.substr(1);
  } else if (const auto colon = text.rfind(':'); colon != kNone) {
    // Several are of an IPv6 address, which needs brackets before a port that may be left out.
    if (!default_port || text.find(':') == colon) {
      host = text.substr(0, colon);
      port = text.substr(colon + 1);
    }
  }
  const auto number = port ? parse_number<std::uint16_t>(*port) : default_port;
  const bool is_plain = host.find_first_of("/@ \t\n") == kNone;
  if (!number || host.empty() || !is_plain) return std::nullopt;
  return NetworkAddress{.host = std::string(host), .port = *number};
}

std::optional<NetworkAddress> parse_listen_address(std::string_view text,
                                                   std::optional<std::uint16_t> default_port) {
  const bool is_port = !text.empty() && text.find_first_not_of("0123456789") == text.npos;
  if (!is_port) return parse_address(text, default_port);
  const auto port = parse_number<std::uint16_t>(text);
  if (!port) return std::nullopt;
  return NetworkAddress{.host = kLoopback, .port = *port};
}

}  // namespace cie
