#include "service_endpoint.hpp"

#include "dds/delivery.hpp"

#include <algorithm>
#include <cerrno>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include <sys/random.h>

namespace cie::executor {
namespace {

constexpr std::string_view kClientKey = "clientid";

struct FreeEndpoint {
  void operator()(dds_builtintopic_endpoint_t* endpoint) const noexcept {
    dds_builtintopic_free_endpoint(endpoint);
  }
};
struct FreeMemory {
  void operator()(void* memory) const noexcept { dds_free(memory); }
};

using EndpointPtr = std::unique_ptr<dds_builtintopic_endpoint_t, FreeEndpoint>;

// What the endpoint told about itself when it was discovered. Null: it left meanwhile.
std::string user_data_of(const EndpointPtr& endpoint) {
  if (endpoint == nullptr) return {};
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint->qos, &data, &size) || data == nullptr) return {};
  const std::unique_ptr<void, FreeMemory> owned{data};
  return {static_cast<const char*>(data), size};
}

// What `get` (dds_get_matched_…) knows to be connected.
template <typename Get>
std::vector<dds_instance_handle_t> matched(dds_entity_t entity, Get get) {
  const dds_return_t count = get(entity, nullptr, 0);
  std::vector<dds_instance_handle_t> handles(static_cast<std::size_t>(std::max(count, 0)));
  const dds_return_t found = get(entity, handles.data(), handles.size());
  handles.resize(std::min(handles.size(), static_cast<std::size_t>(std::max(found, 0))));
  return handles;
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

std::optional<std::string> value_of(std::string_view key, std::string_view user_data) {
  while (!user_data.empty()) {
    const std::string_view entry = user_data.substr(0, user_data.find(';'));
    if (entry.size() > key.size() && entry.starts_with(key) && entry[key.size()] == '=') {
      return std::string{entry.substr(key.size() + 1)};
    }
    user_data.remove_prefix(std::min(user_data.size(), entry.size() + 1));
  }
  return std::nullopt;
}

std::vector<ServiceClients::Client> clients_of(dds_entity_t request_reader,
                                               dds_entity_t reply_writer) {
  std::vector<std::string> hearing;
  for (const auto handle : matched(reply_writer, dds_get_matched_subscriptions)) {
    const EndpointPtr reader{dds_get_matched_subscription_data(reply_writer, handle)};
    if (auto client = value_of(kClientKey, user_data_of(reader)))
      hearing.push_back(std::move(*client));
  }
  std::ranges::sort(hearing);
  std::vector<ServiceClients::Client> clients;
  for (const auto handle : matched(request_reader, dds_get_matched_publications)) {
    const EndpointPtr writer{dds_get_matched_publication_data(request_reader, handle)};
    if (writer == nullptr) continue;
    const auto client = value_of(kClientKey, user_data_of(writer));
    clients.push_back({.writer_gid = writer_gid(writer->key.v),
                       .can_hear = !client || std::ranges::binary_search(hearing, *client)});
  }
  return clients;
}

}  // namespace cie::executor
