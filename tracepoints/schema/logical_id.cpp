#include <cie/tracepoints/logical_id.hpp>

#include <algorithm>

namespace cie {
namespace {

std::string_view kind_name(CallbackKind kind) noexcept {
  switch (kind) {
    case CallbackKind::timer:
      return "Timer";
    case CallbackKind::subscription:
      return "Subscription";
    case CallbackKind::service:
      return "Service";
    case CallbackKind::client:
      return "Client";
    case CallbackKind::waitable:
      return "Waitable";
  }
  return "Callback";
}

bool is_number(std::string_view text) noexcept {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

std::string logical_id(std::string_view qualified_node, CallbackKind kind, std::string_view what) {
  return logical_id(qualified_node, kind_name(kind), what);
}

std::string logical_id(std::string_view qualified_node, std::string_view kind,
                       std::string_view what) {
  std::string id{qualified_node};
  id.append("@").append(kind).append("(").append(what).append(")");
  return id;
}

std::string_view LogicalId::node_of(std::string_view id) noexcept {
  return id.substr(0, id.find('@'));
}

std::string_view LogicalId::kind_of(std::string_view id) noexcept {
  id.remove_prefix(id.find('@') + 1);  // npos + 1 is 0
  return id.substr(0, id.find('('));
}

std::string_view LogicalId::without_number(std::string_view id) noexcept {
  const auto mark = id.rfind('#');
  const bool is_numbered = mark != std::string_view::npos && is_number(id.substr(mark + 1));
  return is_numbered ? id.substr(0, mark) : id;
}

// Only the last ")" ends an id: names of timers and waitables may hold others.
std::optional<LogicalId> LogicalId::parse(std::string_view id) noexcept {
  const auto plain = without_number(id);
  const auto node = node_of(plain);
  const auto kind = kind_of(plain);
  const auto open = node.size() + 1 + kind.size();
  if (node.size() == plain.size() || open >= plain.size() || !plain.ends_with(')')) {
    return std::nullopt;
  }
  return LogicalId{.node = node,
                   .kind = kind,
                   .what = plain.substr(open + 1, plain.size() - open - 2),
                   .number = id.substr(std::min(plain.size() + 1, id.size()))};
}

}  // namespace cie
