// What lies at the addresses of callbacks, and of the objects and buffers that lead to them.
#include "directory.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

Duration apart(Timestamp one, Timestamp other) { return one < other ? other - one : one - other; }

}  // namespace

void Directory::add_object(Address subscription_handle, Address object, const Telling& telling) {
  const auto entity = entities_.find(subscription_handle);
  if (entity != entities_.end() && is_of_former(telling, entity->second)) return;
  auto& known = objects_[object];
  if (is_former(telling, known.made)) return;
  // Of those told by time the ones that were made with this object, and not with the one before.
  const auto before = known.made;
  auto addresses = std::exchange(known.addresses, {});
  std::erase_if(addresses, [&](Address address) {
    const auto made = bindings_[address].made;
    return !made || !before || !telling.made ||
           apart(*made, *telling.made) >= apart(*made, *before);
  });
  known = Object{.handle = subscription_handle, .made = telling.made};
  if (const auto waiting = waiting_.find(object); waiting != waiting_.end()) {
    addresses.insert(addresses.end(), waiting->second.begin(), waiting->second.end());
    waiting_.erase(waiting);
  }
  for (const auto address : addresses) {
    const auto binding = bindings_.find(address);
    if (binding == bindings_.end() || binding->second.object != object) continue;
    release(address, binding->second);
    hold_by(known, address, binding->second, telling);
  }
}

void Directory::add_object_callback(Address object, Address callback, const Telling& telling) {
  if (const auto bound = bindings_.find(callback); bound != bindings_.end()) {
    if (is_former(telling, bound->second.made)) return;
    const bool is_same = bound->second.handle != 0 && bound->second.object == object;
    if (is_same && is_repeated(telling, bound->second.made)) {
      bound->second.made = telling.made;
      confirm(bound->second);
      return;
    }
  }
  auto& binding = take_over(callback, telling);
  binding.object = object;
  const auto known = objects_.find(object);
  const bool is_known = known != objects_.end();
  // By time it is told later whose it is, should the object die.
  const bool is_by_time = is_known && telling.repeats && telling.made && known->second.made;
  if (is_known && (is_by_time || !known->second.has_callback)) {
    hold_by(known->second, callback, binding, telling);
    return;
  }
  // An object that has a callback already died, and this one was made where it lay.
  if (is_known) objects_.erase(known);
  waiting_[object].push_back(callback);
}

void Directory::hold_by(Object& object, Address address, Binding& binding, const Telling& telling) {
  object.has_callback = true;
  if (telling.repeats && telling.made) object.addresses.push_back(address);
  auto& entity = entities_[object.handle];
  if (!entity.is_announced) entity.kind = CallbackKind::subscription;  // others have no object
  hold(address, binding, object.handle);
}

void Directory::add_handle_callback(CallbackKind kind, Address handle, Address callback,
                                    const Telling& telling) {
  auto& entity = entities_[handle];
  if (is_of_former(telling, entity)) return;
  bool is_another = !telling.repeats;
  if (const auto bound = bindings_.find(callback); bound != bindings_.end()) {
    auto& binding = bound->second;
    if (is_former(telling, binding.made)) return;
    const bool has_it = binding.callback != nullptr && entity.callback == binding.callback;
    if (has_it && is_repeated(telling, binding.made)) {
      binding.made = telling.made;
      confirm(binding);
      return;
    }
    is_another = is_another || has_it;
  }
  touch(handle, entity);
  auto& binding = take_over(callback, telling);
  if (is_another && entity.callback != nullptr) leave_callback(kind, handle, entity, telling);
  entity.kind = kind;
  hold(callback, binding, handle);
}

// What the handle was announced to be goes with the callback that was told before that, unless it is
// nearer in time to the one that follows: some handles are never announced.
void Directory::leave_callback(CallbackKind kind, Address handle, Entity& entity,
                               const Telling& telling) {
  auto announced = entity;
  entity.told_before.reset();
  leave_former(handle, entity, telling, false);
  const bool is_of_next =
      announced.told_before && !is_seen(*announced.callback) &&
      apart(*announced.made, *announced.told_before) > apart(*announced.made, *telling.made);
  if (!is_of_next) return;
  describe_anew(*announced.callback, {.kind = kind});
  announced.callback = nullptr;
  announced.addresses.clear();
  announced.told_before.reset();
  entity = std::move(announced);
}

void Directory::stand_for(CallbackKind kind, Address address, Address handle) {
  auto& binding = bindings_[address];
  let_go(address, binding);
  binding = Binding{.told_after = losses_};
  auto& entity = entities_[handle];
  touch(handle, entity);
  if (!entity.is_announced) entity.kind = kind;
  bind(address, binding, handle);
}

void Directory::add_symbol(Address callback, std::string_view symbol, const Telling& telling) {
  auto& binding = bindings_[callback];
  if (is_former(telling, binding.made) || is_former(telling, binding.symbol_made)) return;
  // A second one is that of what will lie there, should that be told.
  binding.is_symbol_of_next = !binding.made || !binding.symbol.empty();
  binding.symbol = symbol;
  binding.symbol_made = telling.made;
  if (binding.callback == nullptr) return;
  auto& known = binding.callback->symbol;
  const bool is_where_it_ran = telling.repeats && telling.made && binding.callback == binding.ran;
  if (known.empty() || is_where_it_ran) known = symbol;
}

// The address is one of the handle's callback. What ran there nameless becomes that callback, unless
// another one has run as that.
void Directory::bind(Address address, Binding& binding, Address handle) {
  forget(address);
  auto& entity = entities_[handle];
  touch(handle, entity);
  auto* const before = entity.callback;
  const bool is_idle = before == nullptr || (before->next_seq == 0 && !before->is_told);
  if (is_idle && is_nameless(binding.ran)) {
    names_late_ = true;
    entity.callback = binding.ran;
    if (before != nullptr) drop(*before);
    for (const auto other : entity.addresses) {
      forget(other);
      bindings_[other].callback = entity.callback;
    }
  } else if (before == nullptr) {
    entity.callback = &new_callback();
  }
  binding.callback = binding.last = entity.callback;
  binding.handle = handle;
  entity.bound_after = binding.told_after;
  auto& callback = *entity.callback;
  callback.handle = handle;
  if (binding.former != nullptr && binding.former != &callback) share(callback, *binding.former);
  const bool is_its_symbol =
      !binding.symbol_made || !binding.made || *binding.symbol_made >= *binding.made;
  if (callback.symbol.empty() && is_its_symbol) callback.symbol = binding.symbol;
  describe_anew(callback, entity);
}

void Directory::share(Callback& callback, Callback& former) noexcept {
  callback.former = &former;
  callback.told_after = former.told_after = kShared;
}

void Directory::confirm(Binding& binding) {
  binding.told_after = losses_;
  const auto entity = entities_.find(binding.handle);
  const bool is_bound = entity != entities_.end() && binding.callback != nullptr &&
                        entity->second.callback == binding.callback;
  if (!is_bound) return;
  entity->second.bound_after = losses_;
  refresh(entity->second);
}

bool Directory::has_run(const Callback* callback, const Telling& telling) noexcept {
  if (!telling.repeats || !is_nameless(callback)) return false;
  const bool was_made_since =
      telling.made && *telling.made > callback->unnamed_since && *telling.made <= telling.told;
  return !was_made_since;
}

Directory::Binding& Directory::take_over(Address address, const Telling& telling) {
  forget(address);
  auto& binding = bindings_[address];
  if (telling.repeats && telling.made) {
    release(address, binding);
  } else {
    let_go(address, binding);
  }
  auto* const ran = has_run(binding.ran, telling) ? binding.ran : nullptr;
  Binding next{.callback = ran,
               .ran = ran,
               .last = binding.last,
               .former = is_begun_again_ ? binding.last : nullptr,
               .made = telling.made,
               .told_after = losses_};
  if (telling.repeats && telling.made) {  // of its symbols the last one may be told first
    next.symbol = std::move(binding.symbol);
    next.symbol_made = binding.symbol_made;
    if (ran != nullptr) ran->symbol.clear();
  } else if (binding.is_symbol_of_next) {
    next.symbol = std::move(binding.symbol);
    next.symbol_made = telling.made;
  }
  return binding = std::move(next);
}

// What ran there unnamed goes with the address, unless it was told under the name that it had until now.
void Directory::release(Address address, Binding& binding) {
  const auto handle = let_go(address, binding);
  if (handle == 0) return;
  auto& entity = entities_[handle];
  touch(handle, entity);
  binding.callback = binding.ran;
  auto* const ran = binding.ran;
  if (ran == nullptr || entity.callback != ran || ran->is_told) return;
  drop(*ran);
  entity.callback = nullptr;
  for (const auto other : entity.addresses)
    bind(other, bindings_[other], handle);
}

Address Directory::let_go(Address address, Binding& binding) {
  const auto handle = std::exchange(binding.handle, 0);
  if (handle != 0) std::erase(entities_[handle].addresses, address);
  return handle;
}

void Directory::hold(Address address, Binding& binding, Address handle) {
  bind(address, binding, handle);
  auto& addresses = entities_[handle].addresses;
  if (std::ranges::find(addresses, address) == addresses.end()) addresses.push_back(address);
}

Callback& Directory::find_callback(Address address, Timestamp now) {
  auto& binding = bindings_[address];
  if (binding.callback == nullptr) {
    binding.callback = binding.ran = binding.last = &new_callback();
    binding.callback->symbol = binding.symbol;
    binding.callback->unnamed_since = now;
  }
  return *binding.callback;
}

Callback* Directory::callback_of_buffer(Address buffer) const {
  const auto object = objects_of_buffers_.find(buffer);
  if (object == objects_of_buffers_.end()) return nullptr;
  const auto between = object->second.to;
  // The object between callbacks is itself a subscription's, or linked to one.
  const auto linked = subscriptions_of_objects_.find(between);
  for (const auto address :
       {linked != subscriptions_of_objects_.end() ? linked->second.to : between, between}) {
    const auto known = objects_.find(address);
    const auto handle = known != objects_.end() ? known->second.handle : address;
    const auto entity = entities_.find(handle);
    const bool is_known = entity != entities_.end() && entity->second.callback != nullptr;
    if (is_known) return entity->second.callback;
  }
  return nullptr;
}

bool Directory::may_feed_another(Address buffer, const Callback& callback) const {
  const auto object = objects_of_buffers_.find(buffer);
  return object == objects_of_buffers_.end() || object->second.told_after != losses_ ||
         may_be_another(callback);
}

}  // namespace cie::analysis::ros2
