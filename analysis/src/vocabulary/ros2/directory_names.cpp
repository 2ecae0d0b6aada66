// What callbacks are called.
#include <cie/tracepoints/logical_id.hpp>

#include "directory.hpp"

#include <algorithm>
#include <utility>

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

// What a tracer that repeats tells of handles and those that had them before changes which of them have
// no callback, and what they are called; nodes may be told later.
void Directory::count_anew() {
  if (std::exchange(has_renamed_, false)) {
    for (const auto& [key, former] : formers_)
      formers_anew_.insert(key);
    for (const auto& [handle, entity] : entities_)
      touch(handle, entity);
  }
  for (const auto& key : std::exchange(formers_anew_, {})) {
    auto& former = formers_.at(key);
    find_node(former);
    formers_by_name_.put(key, plain_id(former), key.second);
  }
  for (const auto handle : std::exchange(entities_anew_, {})) {
    const auto& entity = entities_.at(handle);
    if (!entity.may_repeat || entity.callback != nullptr || !entity.made) {
      entities_by_name_.remove(handle);
      continue;
    }
    Callback its;
    describe(its, entity);
    entities_by_name_.put(handle, plain_id(its), *entity.made);
  }
}

// Those called like it that were made before, as a tracer that repeats tells, and of which no callback is
// known: what was theirs is another one's by then. Several nodes may have one name.
std::uint32_t Directory::count_without_callback(const Callback& callback) {
  if (!names_late_ || !callback.made || !callback.kind) return 0;
  count_anew();
  const auto name = plain_id(callback);
  return formers_by_name_.count_before(name, *callback.made) +
         entities_by_name_.count_before(name, *callback.made);
}

void Directory::look_again(Callback& callback) {
  if (!std::exchange(callback.is_described_anew, true)) described_anew_.push_back(&callback);
}

void Directory::leave_namesakes(Callback& callback) {
  auto* const former = std::exchange(callback.namesakes, nullptr);
  if (former == nullptr) return;
  std::erase(former->callbacks, &callback);
  const auto number = former->numbers.find(callback.number);
  if (number != former->numbers.end()) former->numbers.erase(number);
}

void Directory::join_namesakes(Callback& callback) {
  const auto found = namesakes_.try_emplace(plain_id(callback)).first;
  auto& namesakes = found->second;
  namesakes.plain_id = found->first;
  if (callback.namesakes == &namesakes) return;
  leave_namesakes(callback);
  callback.namesakes = &namesakes;
  auto& all = namesakes.callbacks;
  all.insert(std::ranges::lower_bound(all, callback.id, {}, &Callback::id), &callback);
  if (callback.number != 0) namesakes.numbers.insert(callback.number);
}

void Directory::find_namesakes() {
  if (std::exchange(has_new_nodes_, false) && links_late_) {
    for (auto& callback : callbacks_) {
      const auto before = callback.node;
      if (!callback.is_told) find_node(callback);
      if (callback.node != before) look_again(callback);
    }
  }
  for (auto* callback : std::exchange(described_anew_, {})) {
    callback->is_described_anew = false;
    if (callback->kind) {
      join_namesakes(*callback);
    } else {
      leave_namesakes(*callback);
    }
  }
}

std::string Directory::logical_id(Callback& callback) {
  find_namesakes();
  if (links_late_ || callback.namesakes == nullptr) join_namesakes(callback);
  auto& [text, namesakes, numbers] = *callback.namesakes;
  const auto is_earlier = [&](const Callback* other) {
    const bool is_told_when = callback.made && other->made && *callback.made != *other->made;
    return is_told_when ? *other->made < *callback.made : other->id < callback.id;
  };
  // One that was made later may have been told first, where names come late.
  const auto earlier =
      names_late_
          ? std::ranges::count_if(namesakes, is_earlier)
          : std::ranges::lower_bound(namesakes, callback.id, {}, &Callback::id) - namesakes.begin();
  auto number = 1 + count_without_callback(callback) + static_cast<std::uint32_t>(earlier);
  while (numbers.contains(number))
    ++number;
  callback.number = number;
  numbers.insert(number);
  std::string id(text);
  if (number > 1) id += "#" + std::to_string(number);
  return id;
}

}  // namespace cie::analysis::ros2
