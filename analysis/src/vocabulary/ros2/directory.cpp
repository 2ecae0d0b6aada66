#include "directory.hpp"

#include <algorithm>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

constexpr std::uint32_t kFirstCallerId = 2'000'000;

// An action is made of three services and two topics. One of them stands for it.
constexpr std::string_view kActionPart = "/_action/";
constexpr std::string_view kActionGoal = "/_action/send_goal";

bool is_of_action(std::string_view service) {
  return service.find(kActionPart) != std::string_view::npos;
}

std::string action_of(std::string_view service) {
  return std::string(service.substr(0, service.rfind(kActionPart)));
}

Duration apart(Timestamp one, Timestamp other) { return one < other ? other - one : one - other; }

}  // namespace

void Directory::add_node(Address handle, std::string_view name, std::string_view name_space,
                         const Telling& telling) {
  std::string full(name_space);
  if (full.empty() || full.back() != '/') full += '/';
  full += name;
  auto& nodes = nodes_by_handle_[handle];
  const auto next = std::ranges::find_if(
      nodes, [&](const NodeOfHandle& known) { return is_former(telling, known.made); });
  const auto is_it = [&](const NodeOfHandle& known) { return node(known.node)->name == full; };
  if (next != nodes.begin() && is_it(*std::prev(next))) return;
  if (next != nodes.end() && is_it(*next)) {
    next->made = telling.made;
    return;
  }
  const auto id = id_of<NodeId>(nodes_.size());
  nodes_.push_back(Node{.id = id, .name = std::move(full)});
  if (telling.repeats) {
    nodes.insert(next, {.made = telling.made, .node = id});
  } else {
    nodes.assign(1, {.made = telling.made, .node = id});
  }
}

std::optional<NodeId> Directory::node_of(Address handle, const Made& made) const {
  const auto found = nodes_by_handle_.find(handle);
  if (found == nodes_by_handle_.end()) return std::nullopt;
  const auto& nodes = found->second;
  const auto later = std::ranges::find_if(nodes, [&made](const NodeOfHandle& known) {
    return made && known.made && *known.made > *made;
  });
  return (later == nodes.begin() ? *later : *std::prev(later)).node;
}

void Directory::set_node(Entity& entity, Address node, const Telling& telling) const {
  if (is_former(telling, entity.node_made)) return;
  entity.node = node_of(node, telling.made);
  entity.is_node_unknown = !entity.node;
  entity.node_made = telling.made;
  entity.node_handle = telling.repeats ? node : 0;
}

void Directory::find_node(const Callback& callback) {
  const auto found = entities_.find(callback.handle);
  if (found == entities_.end() || found->second.callback != &callback) return;
  auto& entity = found->second;
  if (entity.node_handle == 0) return;
  entity.node = node_of(entity.node_handle, entity.node_made);
  entity.is_node_unknown = !entity.node;
  refresh(entity);
}

Node* Directory::node(NodeId id) {
  const auto number = static_cast<std::size_t>(to_number(id) - kFirstId);
  return number < nodes_.size() ? &nodes_[number] : nullptr;
}

bool Directory::is_renewed(Publisher& known, std::string_view topic, const Telling& telling) {
  if (is_former(telling, known.made)) return false;
  known.made = telling.made;
  return !telling.repeats || known.topic != topic;
}

void Directory::add_publisher(Address handle, Address node, std::string_view topic,
                              std::uint64_t gid, const Telling& telling) {
  auto& entry = publishers_[handle];
  if (!is_renewed(entry, topic, telling)) return;
  entry = Publisher{.id = id_of<PublisherId>(publishers_made_++),
                    .node = node_of(node, telling.made),
                    .topic = std::string(topic),
                    .gid = gid,
                    .made = telling.made};
}

bool Directory::add_caller(Address rmw_handle, Address node, std::string_view topic,
                           std::uint64_t gid, const Telling& telling) {
  auto& entry = callers_[rmw_handle];
  if (is_renewed(entry, topic, telling)) {
    entry = Publisher{.id = PublisherId{kFirstCallerId + callers_made_++},
                      .node = node_of(node, telling.made),
                      .topic = std::string(topic),
                      .gid = gid,
                      .made = telling.made};
  }
  return entry.topic == topic;
}

Publisher* Directory::caller(Address rmw_handle) {
  const auto found = callers_.find(rmw_handle);
  return found == callers_.end() ? nullptr : &found->second;
}

Publisher& Directory::publisher(Address handle) {
  const auto [found, is_new] = publishers_.try_emplace(handle);
  if (is_new) found->second.id = id_of<PublisherId>(publishers_made_++);
  return found->second;
}

// A handle's new meaning; the one it has when it was merely told again, or mentioned before.
Directory::Entity* Directory::renew(Address handle, const Entity& described,
                                    const Telling& telling) {
  auto& entity = entities_[handle];
  if (is_of_former(telling, entity)) return nullptr;
  const bool is_same = telling.repeats && entity.is_announced && entity.kind == described.kind &&
                       entity.source == described.source && entity.period_ns == described.period_ns;
  if (!is_same) leave_former(handle, entity, telling);
  entity.kind = described.kind;
  entity.source = described.source;
  entity.period_ns = described.period_ns;
  entity.made = telling.made;
  entity.is_announced = true;
  entity.told_after = losses_;
  names_late_ = names_late_ || (telling.repeats && telling.made);
  return &entity;
}

// What was told of a handle belongs to what is told to have it now if it was made since; where that is
// not told, if nothing had the handle before.
void Directory::leave_former(Address handle, Entity& entity, const Telling& telling) {
  const bool is_first = !entity.is_announced;
  const auto is_its = [&telling, is_first](const Made& made) {
    return telling.repeats && telling.made && made ? *made >= *telling.made : is_first;
  };
  const auto former = std::exchange(entity, {});
  if (is_its(former.group_made)) {
    entity.group = former.group;
    entity.group_made = former.group_made;
  }
  if (is_its(former.node_made)) {
    entity.node = former.node;
    entity.node_made = former.node_made;
    entity.is_node_unknown = former.is_node_unknown;
    entity.node_handle = former.node_handle;
  }
  const auto is_bound_since = [&](Address address) { return is_its(bindings_[address].made); };
  if (is_first && std::ranges::all_of(former.addresses, is_bound_since)) {
    entity.callback = former.callback;
    entity.bound_after = former.bound_after;
    entity.addresses = former.addresses;
    return;
  }
  for (const auto address : former.addresses) {
    forget(address);
    auto& binding = bindings_[address];
    binding.handle = 0;
    binding.callback = binding.ran;
    if (telling.repeats && binding.ran != nullptr && !binding.ran->is_told)
      binding.ran->kind.reset();
    if (is_bound_since(address)) hold(address, binding, handle);
  }
}

void Directory::add_subscription(const SubscriptionInit& init, const Telling& telling) {
  Entity described{.kind = CallbackKind::subscription, .source = std::string(init.topic)};
  auto* entity = renew(init.handle, described, telling);
  if (entity == nullptr) return;
  set_node(*entity, init.node, telling);
  entity->queue_depth = init.queue_depth;
  entity->rmw_subscription = init.rmw_handle;
  refresh(*entity);
}

void Directory::add_service(Address handle, Address node, std::string_view service,
                            const Telling& telling) {
  Entity described{.kind = CallbackKind::service, .source = std::string(service)};
  auto* entity = renew(handle, described, telling);
  if (entity == nullptr) return;
  set_node(*entity, node, telling);
  refresh(*entity);
  if (service.ends_with(kActionGoal))
    hide(*entity, {.what = "the action server of " + action_of(service), .is_action = true});
}

void Directory::add_client(Address handle, Address node, std::string_view service,
                           Address rmw_handle, const Telling& telling) {
  Entity described{.kind = CallbackKind::client, .source = std::string(service)};
  auto* entity = renew(handle, described, telling);
  if (entity == nullptr) return;
  set_node(*entity, node, telling);
  if (!is_of_action(service)) {
    hide(*entity, {.what = "the client of " + std::string(service), .is_client = true});
    auto& client = clients_[rmw_handle];
    if (!is_former(telling, client.made))
      client = {.number = *entity->hidden, .made = telling.made};
  } else if (service.ends_with(kActionGoal)) {
    hide(*entity, {.what = "the action client of " + action_of(service),
                   .is_client = true,
                   .is_action = true});
  }
}

// Once, however often it is told.
void Directory::hide(Entity& entity, Hidden hidden) {
  if (entity.hidden) return;
  entity.hidden = static_cast<std::uint32_t>(hidden_.size());
  news_of_hidden_.push_back(*entity.hidden);
  hidden.node = entity.node;
  hidden.group = entity.group;
  hidden_.push_back(std::move(hidden));
}

std::optional<std::uint32_t> Directory::hidden_of(Address rmw_client) const {
  const auto found = clients_.find(rmw_client);
  return found == clients_.end() ? std::nullopt : std::optional(found->second.number);
}

void Directory::add_timer(Address handle, std::uint64_t period_ns, std::optional<TimerMade> made,
                          const Telling& telling) {
  Entity described{.kind = CallbackKind::timer, .period_ns = period_ns};
  auto* entity = renew(handle, described, telling);
  if (entity == nullptr) return;
  if (made) {
    entity->first_expiry = made->at + Duration{static_cast<std::int64_t>(period_ns)};
    entity->expiry_spread = made->spread;
  }
  refresh(*entity);
}

void Directory::link_timer(Address handle, Address node, const Telling& telling) {
  links_timers_ = true;
  auto& entity = entities_[handle];
  if (is_of_former(telling, entity)) return;
  set_node(entity, node, telling);
  refresh(entity);
}

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
    if (telling.repeats && is_same) {
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
  hold(address, binding, object.handle);
}

void Directory::add_handle_callback(CallbackKind kind, Address handle, Address callback,
                                    const Telling& telling) {
  auto& entity = entities_[handle];
  if (is_of_former(telling, entity)) return;
  if (const auto bound = bindings_.find(callback); bound != bindings_.end()) {
    auto& binding = bound->second;
    if (is_former(telling, binding.made)) return;
    if (binding.callback != nullptr && entity.callback == binding.callback) {
      binding.made = telling.made;
      confirm(binding);
      return;
    }
  }
  auto& binding = take_over(callback, telling);
  entity.kind = kind;
  hold(callback, binding, handle);
}

void Directory::stand_for(CallbackKind kind, Address address, Address handle) {
  auto& binding = bindings_[address] = Binding{.told_after = losses_};
  auto& entity = entities_[handle];
  if (!entity.is_announced) entity.kind = kind;
  bind(address, binding, handle);
}

void Directory::add_symbol(Address callback, std::string_view symbol, const Telling& telling) {
  const auto found = bindings_.find(callback);
  if (found == bindings_.end()) return;
  auto& binding = found->second;
  if (is_former(telling, binding.made) || is_former(telling, binding.symbol_made)) return;
  binding.symbol = symbol;
  binding.symbol_made = telling.made;
  if (binding.callback == nullptr) return;
  auto& known = binding.callback->symbol;
  const bool is_where_it_ran = telling.repeats && telling.made && binding.callback == binding.ran;
  if (known.empty() || is_where_it_ran) known = symbol;
}

void Directory::add_group(Address group, std::string_view type, const Telling& telling) {
  const auto [found, is_new] = groups_.try_emplace(group);
  auto& known = found->second;
  if (is_new) known.id = id_of<GroupId>(groups_.size() - 1);
  if (is_former(telling, known.type_made)) return;
  known.type_made = telling.made;
  if (type == "mutually_exclusive") known.type = GroupType::mutually_exclusive;
  if (type == "reentrant") known.type = GroupType::reentrant;
}

void Directory::join_group(Address group, Address handle, const Telling& telling) {
  auto& entity = entities_[handle];
  if (is_of_former(telling, entity) || is_former(telling, entity.group_made)) return;
  entity.group = group;
  entity.group_made = telling.made;
  refresh(entity);
  if (!entity.hidden) return;
  hidden_[*entity.hidden].group = group;
  news_of_hidden_.push_back(*entity.hidden);
}

std::optional<GroupId> Directory::group(Address address) const {
  const auto found = groups_.find(address);
  if (found == groups_.end()) return std::nullopt;
  return found->second.id;
}

std::optional<GroupType> Directory::group_type(Address address) const {
  const auto found = groups_.find(address);
  return found == groups_.end() ? std::nullopt : found->second.type;
}

Callback& Directory::new_callback() {
  return callbacks_.emplace_back(
      Callback{.id = id_of<CallbackId>(callbacks_.size()), .told_after = losses_});
}

void Directory::describe(Callback& callback, const Entity& entity) const {
  callback.kind = entity.kind;
  callback.node = entity.node;
  callback.source = entity.source;
  callback.period_ns = entity.period_ns;
  callback.first_expiry = entity.first_expiry;
  callback.expiry_spread = entity.expiry_spread;
  callback.queue_depth = entity.queue_depth;
  callback.rmw_subscription = entity.rmw_subscription;
  callback.group = entity.group;
  callback.made = entity.made;
  callback.told_after = std::min(entity.told_after, entity.bound_after);
  const bool is_timer = entity.kind == CallbackKind::timer;
  const bool lacks_node = entity.is_node_unknown || (is_timer && links_timers_ && !entity.node);
  callback.is_identified = entity.is_announced && !lacks_node;
}

void Directory::refresh(const Entity& entity) {
  if (entity.callback != nullptr) describe(*entity.callback, entity);
}

// The address is one of the handle's callback. What ran there nameless becomes that callback, unless
// another one has run as that.
void Directory::bind(Address address, Binding& binding, Address handle) {
  forget(address);
  auto& entity = entities_[handle];
  auto* const before = entity.callback;
  const bool is_idle = before == nullptr || (before->next_seq == 0 && !before->is_told);
  if (is_idle && is_nameless(binding.ran)) {
    names_late_ = true;
    entity.callback = binding.ran;
    if (before != nullptr) before->kind.reset();
    for (const auto other : entity.addresses) {
      forget(other);
      bindings_[other].callback = entity.callback;
    }
  } else if (before == nullptr) {
    entity.callback = &new_callback();
  }
  binding.callback = entity.callback;
  binding.handle = handle;
  entity.bound_after = binding.told_after;
  auto& callback = *entity.callback;
  callback.handle = handle;
  const bool is_its_symbol =
      !binding.symbol_made || !binding.made || *binding.symbol_made >= *binding.made;
  if (callback.symbol.empty() && is_its_symbol) callback.symbol = binding.symbol;
  describe(callback, entity);
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
  if (telling.repeats && telling.made) release(address, binding);
  auto* const ran = has_run(binding.ran, telling) ? binding.ran : nullptr;
  Binding next{.callback = ran, .ran = ran, .made = telling.made, .told_after = losses_};
  if (telling.repeats && telling.made) {  // of its symbols the last one may be told first
    next.symbol = std::move(binding.symbol);
    next.symbol_made = binding.symbol_made;
    if (ran != nullptr) ran->symbol.clear();
  }
  return binding = std::move(next);
}

// What ran there unnamed goes with the address, unless it was told under the name that it had until now.
void Directory::release(Address address, Binding& binding) {
  const auto handle = std::exchange(binding.handle, 0);
  if (handle == 0) return;
  auto& entity = entities_[handle];
  std::erase(entity.addresses, address);
  binding.callback = binding.ran;
  auto* const ran = binding.ran;
  if (ran == nullptr || entity.callback != ran || ran->is_told) return;
  ran->kind.reset();
  entity.callback = nullptr;
  for (const auto other : entity.addresses)
    bind(other, bindings_[other], handle);
}

void Directory::hold(Address address, Binding& binding, Address handle) {
  bind(address, binding, handle);
  auto& addresses = entities_[handle].addresses;
  if (std::ranges::find(addresses, address) == addresses.end()) addresses.push_back(address);
}

Callback& Directory::find_callback(Address address, Timestamp now) {
  auto& binding = bindings_[address];
  if (binding.callback == nullptr) {
    binding.callback = binding.ran = &new_callback();
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
