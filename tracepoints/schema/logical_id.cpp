#include <cie/tracepoints/logical_id.hpp>

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

}  // namespace cie
