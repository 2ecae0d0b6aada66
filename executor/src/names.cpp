#include "names.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include <cxxabi.h>

namespace cie::executor {
namespace {

bool is_token(std::string_view text) noexcept {
  const auto is_word = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !text.empty() && std::ranges::all_of(text, is_word) &&
         std::isdigit(static_cast<unsigned char>(text.front())) == 0;
}

// "/a/b": each part a token.
bool is_absolute_name(std::string_view text) noexcept {
  while (!text.empty()) {
    if (text.front() != '/') return false;
    text.remove_prefix(1);
    const auto end = std::min(text.find('/'), text.size());
    if (!is_token(text.substr(0, end))) return false;
    text.remove_prefix(end);
  }
  return true;
}

[[noreturn]] void refuse(std::string_view what, std::string_view name) {
  throw std::invalid_argument{std::string{what} + " \"" + std::string{name} +
                              "\" is not usable: letters, digits and underscores, parts separated "
                              "by single slashes and not starting with a digit"};
}

std::string_view last_part(std::string_view name) noexcept {
  return name.substr(name.rfind('/') + 1);  // npos + 1 is 0: a name without slash is its last part
}

// "100ms": the largest unit that the period is a whole number of.
std::string short_period(std::uint64_t ns) {
  constexpr std::uint64_t kThousand = 1000;
  if (ns % (kThousand * kThousand) == 0) return std::to_string(ns / kThousand / kThousand) + "ms";
  if (ns % kThousand == 0) return std::to_string(ns / kThousand) + "us";
  return std::to_string(ns) + "ns";
}

}  // namespace

std::string qualified_node_name(std::string_view name, std::string_view name_space) {
  if (!is_token(name)) refuse("node name", name);
  std::string prefix{name_space};
  if (prefix.empty() || prefix.front() != '/') prefix.insert(prefix.begin(), '/');
  if (prefix == "/") prefix.clear();
  if (!is_absolute_name(prefix)) refuse("namespace", name_space);
  return prefix + "/" + std::string{name};
}

std::string qualified_topic(std::string_view topic, std::string_view qualified_node) {
  std::string name;
  if (topic.starts_with('/')) {
    name = topic;
  } else if (topic.starts_with("~/")) {
    name = std::string{qualified_node} + std::string{topic.substr(1)};
  } else {
    name = std::string{qualified_node.substr(0, qualified_node.rfind('/') + 1)}.append(topic);
  }
  if (name == "/" || topic.empty() || !is_absolute_name(name)) refuse("topic", topic);
  return name;
}

TopicName message_topic(std::string_view qualified_topic) {
  const std::string topic{qualified_topic};
  return {.ros = topic, .dds = "rt" + topic};
}

TopicName request_topic(std::string_view qualified_service) {
  const std::string topic = std::string{qualified_service} + "Request";
  return {.ros = topic, .dds = "rq" + topic};
}

TopicName reply_topic(std::string_view qualified_service) {
  const std::string topic = std::string{qualified_service} + "Reply";
  return {.ros = topic, .dds = "rr" + topic};
}

std::string thread_label(const trace::CallbackInfo& info) {
  constexpr std::size_t kRoom = 15;  // TASK_COMM_LEN without its terminator
  const std::string_view id = info.logical_id;
  std::string node{last_part(id.substr(0, id.find('@')))};
  std::string source = info.kind == CallbackKind::timer
                           ? (info.period_ns == 0 ? "once" : short_period(info.period_ns))
                           : info.source.substr(info.source.starts_with('/') ? 1 : 0);
  const std::size_t source_room = std::max(kRoom / 2, kRoom - 1 - std::min(node.size(), kRoom - 1));
  source.resize(std::min(source.size(), source_room));
  node.resize(std::min(node.size(), kRoom - 1 - source.size()));
  return node + ":" + source;
}

std::string demangled(const std::type_info& type) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text{
      abi::__cxa_demangle(type.name(), nullptr, nullptr, &status), &std::free};
  return status == 0 && text ? text.get() : type.name();
}

}  // namespace cie::executor
