// What callbacks are called.
#include <cie/tracepoints/logical_id.hpp>

#include "directory.hpp"

#include <algorithm>

namespace cie::analysis::ros2 {

std::string_view Directory::node_name(const Callback& callback) const {
  return callback.node ? std::string_view(nodes_[to_number(*callback.node) - kFirstId].name) : "?";
}

bool Directory::is_described(const Callback& callback) noexcept {
  return callback.kind == CallbackKind::timer ? callback.period_ns.has_value()
                                              : !callback.source.empty();
}

std::string Directory::plain_id(const Callback& callback) const {
  const bool is_timer = callback.kind == CallbackKind::timer;
  const auto what = is_timer ? std::to_string(callback.period_ns.value_or(0)) : callback.source;
  return cie::logical_id(node_name(callback), callback.kind.value_or(CallbackKind::waitable),
                         is_described(callback) ? what : "?");
}

// But for their numbers. Several nodes may have one name.
bool Directory::is_called_like(const Callback& callback, Callback& other) const {
  const bool is_alike = other.kind == callback.kind && other.period_ns == callback.period_ns &&
                        other.source == callback.source;
  if (is_alike && !other.is_told) find_node(other);
  return is_alike && node_name(other) == node_name(callback);
}

// Those called like it that were made before, as a tracer that repeats tells, and of which no callback is
// known: what was theirs is another one's by then.
std::uint32_t Directory::count_without_callback(const Callback& callback) {
  if (!names_late_ || !callback.made) return 0;
  std::uint32_t count = 0;
  const auto consider = [&](Callback& other) {
    if (*other.made < *callback.made && is_called_like(callback, other)) ++count;
  };
  for (auto& former : formers_)
    consider(former);
  for (const auto& [handle, entity] : entities_) {
    if (!entity.may_repeat || entity.callback != nullptr || !entity.made) continue;
    Callback its;
    describe(its, entity);
    consider(its);
  }
  return count;
}

std::string Directory::logical_id(Callback& callback) {
  auto text = plain_id(callback);
  std::uint32_t number = 1 + count_without_callback(callback);
  std::vector<std::uint32_t> told;
  bool is_before = true;
  const auto is_earlier = [&](const Callback& other) {
    const bool is_told_when =
        names_late_ && callback.made && other.made && *callback.made != *other.made;
    return is_told_when ? *other.made < *callback.made : is_before;
  };
  for (auto& other : callbacks_) {
    if (&other == &callback) {
      if (!names_late_) break;
      is_before = false;  // a later one may have been told first
    } else if (is_called_like(callback, other)) {
      if (is_earlier(other)) ++number;
      if (other.number != 0) told.push_back(other.number);
    }
  }
  while (std::ranges::find(told, number) != told.end())
    ++number;
  callback.number = number;
  if (number > 1) text += "#" + std::to_string(number);
  return text;
}

}  // namespace cie::analysis::ros2
