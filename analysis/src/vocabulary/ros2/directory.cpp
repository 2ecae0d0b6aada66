#include "directory.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include <algorithm>
#include <utility>

namespace cie::analysis::ros2 {
namespace {

// Far from what an executor of this project numbers from 0, should a process have both.
constexpr std::uint32_t kFirstId = 1'000'000;
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

template <typename Id>
Id id_of(std::size_t number) noexcept {
  return static_cast<Id>(kFirstId + static_cast<std::uint32_t>(number));
}

}  // namespace

void Directory::add_node(Address handle, std::string_view name, std::string_view name_space) {
  std::string full(name_space);
  if (full.empty() || full.back() != '/') full += '/';
  full += name;
  const auto known = nodes_by_handle_.find(handle);
  if (known != nodes_by_handle_.end() && node(known->second)->name == full) return;
  const auto id = id_of<NodeId>(nodes_.size());
  nodes_.push_back(Node{.id = id, .name = std::move(full)});
  nodes_by_handle_[handle] = id;
}

std::optional<NodeId> Directory::node_of(Address handle) const {
  const auto found = nodes_by_handle_.find(handle);
  if (found == nodes_by_handle_.end()) return std::nullopt;
  return found->second;
}

void Directory::set_node(Entity& entity, Address node) const {
  entity.node = node_of(node);
  entity.is_node_unknown = !entity.node;
}

Node* Directory::node(NodeId id) {
  const auto number = static_cast<std::size_t>(to_number(id) - kFirstId);
  return number < nodes_.size() ? &nodes_[number] : nullptr;
}

void Directory::add_publisher(Address handle, Address node, std::string_view topic,
                              std::uint64_t gid, bool repeats) {
  auto& entry = publishers_[handle];
  if (repeats && entry.topic == topic) return;
  entry = Publisher{.id = id_of<PublisherId>(publishers_made_++),
                    .node = node_of(node),
                    .topic = std::string(topic),
                    .gid = gid};
}

void Directory::add_caller(Address rmw_handle, Address node, std::string_view topic,
                           std::uint64_t gid, bool repeats) {
  auto& entry = callers_[rmw_handle];
  if (repeats && entry.topic == topic) return;
  entry = Publisher{.id = PublisherId{kFirstCallerId + callers_made_++},
                    .node = node_of(node),
                    .topic = std::string(topic),
                    .gid = gid};
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
Directory::Entity& Directory::renew(Address handle, CallbackKind kind, std::string_view source,
                                    bool repeats) {
  auto& entity = entities_[handle];
  const bool is_same = repeats && entity.kind == kind && entity.source == source;
  if (entity.is_announced && !is_same) entity = {};
  entity.kind = kind;
  entity.source = source;
  entity.is_announced = true;
  entity.told_after = losses_;
  return entity;
}

void Directory::add_subscription(const SubscriptionInit& init, bool repeats) {
  auto& entity = renew(init.handle, CallbackKind::subscription, init.topic, repeats);
  set_node(entity, init.node);
  entity.queue_depth = init.queue_depth;
  entity.rmw_subscription = init.rmw_handle;
  refresh(entity);
}

void Directory::add_service(Address handle, Address node, std::string_view service, bool repeats) {
  auto& entity = renew(handle, CallbackKind::service, service, repeats);
  set_node(entity, node);
  refresh(entity);
  if (service.ends_with(kActionGoal))
    hide(entity, {.what = "the action server of " + action_of(service), .is_action = true});
}

void Directory::add_client(Address handle, Address node, std::string_view service,
                           Address rmw_handle, bool repeats) {
  auto& entity = renew(handle, CallbackKind::client, service, repeats);
  set_node(entity, node);
  if (!is_of_action(service)) {
    hide(entity, {.what = "the client of " + std::string(service), .is_client = true});
    clients_[rmw_handle] = *entity.hidden;
  } else if (service.ends_with(kActionGoal)) {
    hide(entity, {.what = "the action client of " + action_of(service),
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
  return found == clients_.end() ? std::nullopt : std::optional(found->second);
}

void Directory::add_timer(Address handle, std::uint64_t period_ns, std::optional<Timestamp> made,
                          bool repeats) {
  auto& known = entities_[handle];
  const bool is_same = repeats && known.is_announced && known.period_ns == period_ns;
  auto& entity = renew(handle, CallbackKind::timer, {}, is_same);
  entity.period_ns = period_ns;
  if (made) entity.first_expiry = *made + Duration{static_cast<std::int64_t>(period_ns)};
  refresh(entity);
}

void Directory::link_timer(Address handle, Address node) {
  links_timers_ = true;
  auto& entity = entities_[handle];
  set_node(entity, node);
  refresh(entity);
}

void Directory::add_object(Address subscription_handle, Address object) {
  auto& known = objects_[object];
  if (known.handle != subscription_handle) known = Object{.handle = subscription_handle};
  known.has_callback = false;
  const auto waiting = waiting_.find(object);
  if (waiting == waiting_.end()) return;
  for (const auto address : waiting->second) {
    const auto binding = bindings_.find(address);
    if (binding == bindings_.end() || binding->second.object != object) continue;
    bind(address, binding->second, subscription_handle);
    known.has_callback = true;
  }
  waiting_.erase(waiting);
}

void Directory::add_object_callback(Address object, Address callback, bool repeats) {
  const auto bound = bindings_.find(callback);
  if (repeats && bound != bindings_.end() && bound->second.object == object) {
    confirm(bound->second);
    return;
  }
  forget(callback);
  auto* ran = repeats ? unnamed(callback) : nullptr;
  auto& binding = bindings_[callback] =
      Binding{.object = object, .callback = ran, .told_after = losses_};
  const auto known = objects_.find(object);
  if (known != objects_.end() && !known->second.has_callback) {
    known->second.has_callback = true;
    bind(callback, binding, known->second.handle);
    return;
  }
  // An object that has a callback already died, and this one was made where it lay.
  if (known != objects_.end()) objects_.erase(known);
  waiting_[object].push_back(callback);
}

void Directory::add_handle_callback(CallbackKind kind, Address handle, Address callback,
                                    bool repeats) {
  auto& binding = bindings_[callback];
  const auto entity = entities_.find(handle);
  const bool is_same = binding.callback != nullptr && entity != entities_.end() &&
                       entity->second.callback == binding.callback;
  if (is_same) {
    confirm(binding);
    return;
  }
  auto* ran = repeats ? unnamed(callback) : nullptr;
  binding = Binding{.callback = ran, .told_after = losses_};
  auto& of_handle = entities_[handle];
  of_handle.kind = kind;
  bind(callback, binding, handle);
}

void Directory::stand_for(CallbackKind kind, Address address, Address handle) {
  auto& binding = bindings_[address] = Binding{.told_after = losses_};
  auto& entity = entities_[handle];
  if (!entity.is_announced) entity.kind = kind;
  bind(address, binding, handle);
}

void Directory::add_symbol(Address callback, std::string_view symbol) {
  const auto found = bindings_.find(callback);
  if (found == bindings_.end()) return;
  found->second.symbol = symbol;
  if (found->second.callback == nullptr) return;
  auto& known = found->second.callback->symbol;
  if (known.empty()) known = symbol;
}

void Directory::add_group(Address group, std::string_view type) {
  const auto [found, is_new] = groups_.try_emplace(group);
  if (is_new) found->second.id = id_of<GroupId>(groups_.size() - 1);
  if (type == "mutually_exclusive") found->second.type = GroupType::mutually_exclusive;
  if (type == "reentrant") found->second.type = GroupType::reentrant;
}

void Directory::join_group(Address group, Address handle) {
  auto& entity = entities_[handle];
  entity.group = group;
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
  callback.queue_depth = entity.queue_depth;
  callback.rmw_subscription = entity.rmw_subscription;
  callback.group = entity.group;
  callback.told_after = std::min(entity.told_after, entity.bound_after);
  const bool is_timer = entity.kind == CallbackKind::timer;
  const bool lacks_node = entity.is_node_unknown || (is_timer && links_timers_ && !entity.node);
  callback.is_identified = entity.is_announced && !lacks_node;
}

void Directory::refresh(const Entity& entity) {
  if (entity.callback != nullptr) describe(*entity.callback, entity);
}

// The address is one of the handle's callback. What ran there unknown becomes that callback.
void Directory::bind(Address address, Binding& binding, Address handle) {
  forget(address);
  auto& entity = entities_[handle];
  if (entity.callback == nullptr) {
    names_late_ = names_late_ || binding.callback != nullptr;
    entity.callback = binding.callback != nullptr ? binding.callback : &new_callback();
  }
  binding.callback = entity.callback;
  entity.bound_after = binding.told_after;
  binding.handle = handle;
  auto& callback = *entity.callback;
  if (callback.symbol.empty()) callback.symbol = binding.symbol;
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

Callback* Directory::unnamed(Address address) const {
  const auto found = bindings_.find(address);
  if (found == bindings_.end()) return nullptr;
  auto* callback = found->second.callback;
  return callback != nullptr && !callback->kind ? callback : nullptr;
}

Callback& Directory::find_callback(Address address) {
  auto& binding = bindings_[address];
  if (binding.callback == nullptr) {
    binding.callback = &new_callback();
    binding.callback->symbol = binding.symbol;
  }
  return *binding.callback;
}

Callback* Directory::callback_of_buffer(Address buffer) const {
  const auto object = objects_of_buffers_.find(buffer);
  if (object == objects_of_buffers_.end()) return nullptr;
  const auto between = object->second.object;
  // The object between callbacks is itself a subscription's, or linked to one.
  const auto linked = subscriptions_of_objects_.find(between);
  for (const auto address :
       {linked != subscriptions_of_objects_.end() ? linked->second : between, between}) {
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

std::string_view Directory::node_name(const Callback& callback) const {
  return callback.node ? std::string_view(nodes_[to_number(*callback.node) - kFirstId].name) : "?";
}

std::string Directory::plain_id(const Callback& callback) const {
  const bool is_timer = callback.kind == CallbackKind::timer;
  const bool is_known = is_timer ? callback.period_ns.has_value() : !callback.source.empty();
  const auto what = is_timer ? std::to_string(callback.period_ns.value_or(0)) : callback.source;
  return cie::logical_id(node_name(callback), callback.kind.value_or(CallbackKind::waitable),
                         is_known ? what : "?");
}

std::string Directory::logical_id(Callback& callback) const {
  auto text = plain_id(callback);
  const auto node = node_name(callback);  // several nodes may have it
  const auto has_same_id = [&](const Callback& other) {
    return other.kind == callback.kind && other.period_ns == callback.period_ns &&
           other.source == callback.source && node_name(other) == node;
  };
  std::uint32_t number = 1;
  std::vector<std::uint32_t> told;
  bool is_earlier = true;
  for (const auto& other : callbacks_) {
    if (&other == &callback) {
      if (!names_late_) break;
      is_earlier = false;  // a later one may have been told first
    } else if (has_same_id(other)) {
      if (is_earlier) ++number;
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
