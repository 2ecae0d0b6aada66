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

std::string demangled(const std::type_info& type) {
  int status = 0;
  const std::unique_ptr<char, decltype(&std::free)> text{
      abi::__cxa_demangle(type.name(), nullptr, nullptr, &status), &std::free};
  return status == 0 && text ? text.get() : type.name();
}

}  // namespace cie::executor
