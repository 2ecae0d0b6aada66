#include "directory.hpp"

#include <algorithm>
#include <iterator>
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
  has_new_nodes_ = has_renamed_ = true;
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
  end_awaiting(handle);
}

void Directory::end_awaiting(Address node) {
  const auto awaiting = awaiting_nodes_.extract(node);
  if (!awaiting) return;
  for (const auto handle : awaiting.mapped().entities) {
    auto& entity = entities_[handle];
    if (entity.awaited_node != node) continue;
    entity.awaited_node = 0;
    entity.node = node_of(node, entity.node_made);
    entity.is_node_unknown = false;
    refresh(entity);
    if (!entity.hidden) continue;
    hidden_[*entity.hidden].node = entity.node;
    news_of_hidden_.push_back(*entity.hidden);
  }
  for (auto* publisher : awaiting.mapped().publishers) {
    if (publisher->awaited_node != node) continue;
    publisher->awaited_node = 0;
    publisher->node = node_of(node, publisher->made);
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

void Directory::set_node(Address handle, Entity& entity, Address node, const Telling& telling) {
  if (is_former(telling, entity.node_made)) return;
  entity.node = node_of(node, telling.made);
  entity.is_node_unknown = !entity.node;
  entity.node_made = telling.made;
  entity.node_handle = telling.repeats ? node : 0;
  links_late_ = links_late_ || telling.repeats;
  const bool is_awaited = entity.is_node_unknown && !telling.repeats && is_told_whole();
  entity.awaited_node = is_awaited ? node : 0;
  if (is_awaited) awaiting_nodes_[node].entities.push_back(handle);
}

// Publishers stay where they are.
void Directory::set_node(Publisher& publisher, Address node) {
  publisher.node = node_of(node, publisher.made);
  if (publisher.node || !is_told_whole()) return;
  publisher.awaited_node = node;
  awaiting_nodes_[node].publishers.push_back(&publisher);
}

void Directory::find_node(Callback& callback) const {
  if (callback.node_handle == 0) return;
  callback.node = node_of(callback.node_handle, callback.node_made);
  callback.is_identified = callback.node && is_described(callback);
}

Node* Directory::node(NodeId id) {
  const auto number = static_cast<std::size_t>(to_number(id) - kFirstId);
  return number < nodes_.size() ? &nodes_[number] : nullptr;
}

bool Directory::is_renewed(Publisher& known, std::string_view topic, const Telling& telling) {
  if (is_former(telling, known.made)) return false;
  const bool is_same = is_repeated(telling, known.made) && known.topic == topic;
  known.made = telling.made;
  return !is_same;
}

void Directory::add_publisher(const AnnouncedPublisher& init, std::uint64_t gid,
                              const Telling& telling) {
  auto& entry = publishers_[init.handle];
  if (!is_renewed(entry, init.topic, telling)) return;
  entry = Publisher{.id = id_of<PublisherId>(publishers_made_++),
                    .topic = std::string(init.topic),
                    .gid = gid,
                    .made = telling.made};
  set_node(entry, init.node);
  if (init.rmw_handle != 0) publishers_of_rmw_[init.rmw_handle] = init.handle;
}

bool Directory::add_caller(Address rmw_handle, Address node, std::string_view topic,
                           std::uint64_t gid, const Telling& telling) {
  auto& entry = callers_[rmw_handle];
  if (is_renewed(entry, topic, telling)) {
    entry = Publisher{.id = PublisherId{kFirstCallerId + callers_made_++},
                      .topic = std::string(topic),
                      .gid = gid,
                      .made = telling.made};
    set_node(entry, node);
  }
  return entry.topic == topic;
}

std::optional<Address> Directory::publisher_of(Address rmw_handle) const {
  const auto found = publishers_of_rmw_.find(rmw_handle);
  return found == publishers_of_rmw_.end() ? std::nullopt : std::optional(found->second);
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
  if (is_of_former(telling, entity)) {
    auto former = described;
    former.made = former.node_made = telling.made;
    if (entity.may_repeat) count_former(handle, former);
    return nullptr;
  }
  const bool is_same = is_repeated(telling, entity.made) && entity.is_announced &&
                       entity.kind == described.kind && entity.source == described.source &&
                       entity.period_ns == described.period_ns;
  // What ran at a handle that was never announced is not what is announced there now, but for a tracer
  // that repeats.
  const bool has_run = entity.callback != nullptr && is_seen(*entity.callback);
  const bool is_first = !entity.is_announced && (telling.repeats || !has_run);
  if (!is_same) leave_former(handle, entity, telling, is_first);
  if (is_first && !telling.repeats) note_told_before(entity);
  entity.kind = described.kind;
  entity.source = described.source;
  entity.period_ns = described.period_ns;
  entity.made = telling.made;
  entity.is_announced = true;
  touch(handle, entity);
  entity.may_repeat = telling.repeats;
  touch(handle, entity);
  entity.told_after = losses_;
  names_late_ = names_late_ || (telling.repeats && telling.made);
  return &entity;
}

void Directory::note_told_before(Entity& entity) {
  entity.told_before = entity.node_made;
  if (!entity.addresses.empty()) entity.told_before = bindings_[entity.addresses.front()].made;
}

// What was told of a handle belongs to what is told to have it now if it was made since; where that is
// not told, if nothing had the handle before.
void Directory::leave_former(Address handle, Entity& entity, const Telling& telling,
                             bool is_first) {
  touch(handle, entity);
  const auto former = std::exchange(entity, {});
  const auto is_its = [&telling, is_first](const Made& made) {
    return telling.repeats && telling.made && made ? *made >= *telling.made : is_first;
  };
  if (is_its(former.group_made)) {
    entity.group = former.group;
    entity.group_made = former.group_made;
  }
  if (is_its(former.node_made)) {
    entity.node = former.node;
    entity.node_made = former.node_made;
    entity.is_node_unknown = former.is_node_unknown;
    entity.awaited_node = former.awaited_node;
    entity.node_handle = former.node_handle;
  }
  const auto is_bound_since = [&](Address address) {
    const auto& made = bindings_[address].made;
    // One after the other is told in the same order.
    const bool is_told_before = former.told_before && made && former.made && *made > *former.made;
    return is_its(made) || is_told_before;
  };
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
    if (telling.repeats && binding.ran != nullptr && !binding.ran->is_told) drop(*binding.ran);
    if (is_bound_since(address)) hold(address, binding, handle);
  }
  if (telling.repeats && former.may_repeat) count_former(handle, former);
}

// It counts where equal ids are numbered, though no callback was told to be its.
void Directory::count_former(Address handle, const Entity& former) {
  if (!former.made) return;
  const HandleAndMade key{handle, *former.made};
  const auto is_it = [&former, handle](const Callback* known) {
    return known->kind && known->handle == handle && known->made == former.made;
  };
  const auto callbacks = callbacks_by_handle_.find(key);
  const bool is_callback =
      callbacks != callbacks_by_handle_.end() && std::ranges::any_of(callbacks->second, is_it);
  if (is_callback) return;
  const auto [counted, is_new] = formers_.try_emplace(key, Callback{.handle = handle});
  if (!is_new) return;
  describe(counted->second, former);
  formers_anew_.insert(key);
}

void Directory::add_subscription(const SubscriptionInit& init, const Telling& telling) {
  Entity described{.kind = CallbackKind::subscription,
                   .source = std::string(init.topic),
                   .node_handle = init.node};
  auto* entity = renew(init.handle, described, telling);
  if (entity == nullptr) return;
  set_node(init.handle, *entity, init.node, telling);
  entity->queue_depth = init.queue_depth;
  entity->rmw_subscription = init.rmw_handle;
  refresh(*entity);
}

void Directory::add_service(Address handle, Address node, std::string_view service,
                            const Telling& telling) {
  Entity described{
      .kind = CallbackKind::service, .source = std::string(service), .node_handle = node};
  auto* entity = renew(handle, described, telling);
  if (entity == nullptr) return;
  set_node(handle, *entity, node, telling);
  refresh(*entity);
  if (service.ends_with(kActionGoal))
    hide(*entity, {.what = "the action server of " + action_of(service), .is_action = true});
}

void Directory::add_client(Address handle, Address node, std::string_view service,
                           Address rmw_handle, const Telling& telling) {
  Entity described{.kind = CallbackKind::client, .source = std::string(service)};
  auto* entity = renew(handle, described, telling);
  if (entity == nullptr) return;
  set_node(handle, *entity, node, telling);
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
  if (is_of_former(telling, entity)) {
    link_former(handle, node, telling);
    return;
  }
  touch(handle, entity);
  const bool is_of_next = !telling.repeats && entity.is_announced && entity.told_before &&
                          entity.node_made && *entity.node_made < *entity.made;
  if (is_of_next) {
    entity.told_before.reset();
    leave_former(handle, entity, telling, false);
  }
  set_node(handle, entity, node, telling);
  refresh(entity);
}

// To the node of the timer that had the handle then.
void Directory::link_former(Address handle, Address node, const Telling& telling) {
  const auto later = formers_.upper_bound({handle, *telling.made});
  if (later == formers_.begin()) return;
  auto& [key, former] = *std::prev(later);
  if (key.first != handle) return;
  former.node_handle = node;
  former.node_made = telling.made;
  formers_anew_.insert(key);
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

void Directory::add_executor(Address executor, std::string_view type) {
  if (type.find("multi_threaded") != std::string_view::npos) {
    pools_.insert(executor);
  } else {
    pools_.erase(executor);
  }
}

void Directory::serve_group(Address group, Address executor) {
  if (executor == 0) return;
  const auto found = groups_.find(group);
  if (found != groups_.end()) found->second.executor = executor;
}

bool Directory::is_pooled(Address group) const {
  const auto found = groups_.find(group);
  return found != groups_.end() && pools_.contains(found->second.executor);
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
  return callbacks_.emplace_back(Callback{.id = id_of<CallbackId>(callbacks_.size()),
                                          .told_after = losses_,
                                          .is_after_rcl_init = is_begun_again_});
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
  if (!shares_address(callback))
    callback.told_after = std::min(entity.told_after, entity.bound_after);
  const bool is_timer = entity.kind == CallbackKind::timer;
  const bool lacks_node = entity.is_node_unknown || (is_timer && links_timers_ && !entity.node);
  callback.is_identified = entity.is_announced && !lacks_node;
  callback.node_handle = entity.node_handle;
  callback.node_made = entity.node_made;
  find_node(callback);
}

void Directory::describe_anew(Callback& callback, const Entity& entity) {
  describe(callback, entity);
  look_again(callback);
  if (!callback.made) return;
  auto& described = callbacks_by_handle_[{callback.handle, *callback.made}];
  if (std::ranges::find(described, &callback) == described.end()) described.push_back(&callback);
}

void Directory::refresh(const Entity& entity) {
  if (entity.callback != nullptr) describe_anew(*entity.callback, entity);
}

}  // namespace cie::analysis::ros2
