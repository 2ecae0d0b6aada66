#include "service_endpoint.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <memory>
#include <system_error>
#include <vector>

#include <sys/random.h>

namespace cie::executor {
namespace {

struct FreeEndpoint {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const noexcept {
    dds_builtintopic_free_endpoint(endpoint);
  }
};
struct FreeMemory {
  void operator()(void* memory) const noexcept { dds_free(memory); }
};

// What the reader told about itself when it was discovered.
std::string user_data_of_reader(dds_entity_t writer, dds_instance_handle_t reader) {
  const std::unique_ptr<dds_builtintopic_endpoint_t, FreeEndpoint> endpoint{
      dds_get_matched_subscription_data(writer, reader)};
  if (endpoint == nullptr) return {};  // it left meanwhile
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint->qos, &data, &size) || data == nullptr) return {};
  const std::unique_ptr<void, FreeMemory> owned{data};
  return {static_cast<const char*>(data), size};
}

}  // namespace

EndpointId::EndpointId() {
  if (getrandom(bytes_.data(), bytes_.size(), 0) != static_cast<ssize_t>(bytes_.size())) {
    throw std::system_error{errno, std::generic_category(), "cannot draw a random identity"};
  }
}

std::uint64_t EndpointId::guid() const noexcept {
  std::uint64_t guid = 0;
  std::memcpy(&guid, bytes_.data(), sizeof guid);
  return guid;
}

std::string EndpointId::user_data(std::string_view key) const {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text{key};
  char separator = '=';
  for (const unsigned char byte : bytes_) {
    text += separator;
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xfU];
    separator = '.';
  }
  return text + ';';
}

std::optional<std::uint64_t> client_guid(std::string_view user_data) noexcept {
  constexpr std::string_view kKey = "clientid=";
  const std::size_t at = user_data.find(kKey);
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view rest = user_data.substr(at + kKey.size());
  std::array<unsigned char, sizeof(std::uint64_t)> bytes{};
  for (unsigned char& byte : bytes) {
    unsigned value = 0;
    const char* const end = rest.data() + std::min<std::size_t>(rest.size(), 2);
    const auto [parsed, error] = std::from_chars(rest.data(), end, value, 16);
    if (error != std::errc{} || parsed != end) return std::nullopt;
    byte = static_cast<unsigned char>(value);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    if (rest.empty() || (rest.front() != '.' && rest.front() != ';')) return std::nullopt;
    rest.remove_prefix(1);
  }
  std::uint64_t guid = 0;
  std::memcpy(&guid, bytes.data(), sizeof guid);
  return guid;
}

bool has_client(dds_entity_t writer, std::uint64_t guid) {
  const dds_return_t count = dds_get_matched_subscriptions(writer, nullptr, 0);
  if (count <= 0) return false;
  std::vector<dds_instance_handle_t> readers(static_cast<std::size_t>(count));
  const dds_return_t found = dds_get_matched_subscriptions(writer, readers.data(), readers.size());
  readers.resize(std::min(readers.size(), static_cast<std::size_t>(std::max(found, 0))));
  return std::ranges::any_of(readers, [writer, guid](dds_instance_handle_t reader) {
    return client_guid(user_data_of_reader(writer, reader)) == guid;
  });
}

}  // namespace cie::executor
