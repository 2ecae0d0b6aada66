#include "rclcpp_node.hpp"

#include <cie/tracepoints/logical_id.hpp>

#include "distributions.hpp"
#include "entity_callback.hpp"
#include "timer_callback.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <rclcpp/logging.hpp>

namespace cie_rclcpp {
namespace {

using cie::CallbackKind;
using cie::GroupType;
using cie::scheduling::GroupState;

// What nodes of rclcpp offer by themselves. Since Iron one tells of types.
constexpr std::array<std::string_view, 7> kParameterServices{
    "describe_parameters",      "get_parameter_types", "get_parameters",
    "get_type_description",     "list_parameters",     "set_parameters",
    "set_parameters_atomically"};
// And what those of rclcpp_lifecycle do, all of them in the node's default group.
constexpr std::array<std::string_view, 5> kLifecycleServices{"change_state", "get_available_states",
                                                             "get_available_transitions",
                                                             "get_state", "get_transition_graph"};

bool is_same(const std::weak_ptr<void>& one, const std::weak_ptr<void>& other) {
  return !one.owner_before(other) && !other.owner_before(one);
}

RclcppNode::Contents contents_of(const std::weak_ptr<rclcpp::CallbackGroup>& group) {
  RclcppNode::Contents contents{.group = group};
  const auto alive = group.lock();
  if (!alive) return contents;
  const auto into = [](auto& list) {
    return [&list](const auto& each) { list.emplace_back(each); };
  };
  alive->collect_all_ptrs(into(contents.subscriptions), into(contents.services),
                          into(contents.clients), into(contents.timers), into(contents.waitables));
  return contents;
}

// Also of the condition's own end, which is that of its node or group.
void listen(rclcpp::GuardCondition& condition, const OnGone& on_change) {
  condition.set_on_trigger_callback(
      [on_change, gone = farewell(on_change)](std::size_t) { on_change(); });
}

}  // namespace

RclcppNode::RclcppNode(const NodeBase::SharedPtr& node, std::shared_ptr<InternalServer> server,
                       OnGone on_change)
    : node_(node),
      name_(node->get_fully_qualified_name()),
      server_(std::move(server)),
      on_change_(std::move(on_change)),
      trace_(name_) {}

RclcppNode::~RclcppNode() { remove_all(); }

Callbacks RclcppNode::callbacks() const {
  const std::lock_guard lock{mutex_};
  Callbacks all;
  for (const Group& group : groups_) {
    for (const Served& served : group.served) {
      if (served.callback) all.push_back(served.callback);
    }
  }
  return all;
}

std::vector<std::shared_ptr<Admitted>> RclcppNode::admitted() const {
  const std::lock_guard lock{mutex_};
  std::vector<std::shared_ptr<Admitted>> all;
  for (const Group& group : groups_) {
    for (const Served& served : group.served) {
      if (auto callback = std::dynamic_pointer_cast<Admitted>(served.callback)) {
        all.push_back(std::move(callback));
      }
      if (served.internal) all.push_back(served.internal->admitted());
    }
  }
  return all;
}

void RclcppNode::listen_internally() {
  const std::lock_guard lock{mutex_};
  for (const Group& group : groups_) {
    for (const Served& served : group.served) {
      if (served.internal) served.internal->listen();
    }
  }
}

void RclcppNode::rest_internally() noexcept {
  const std::lock_guard lock{mutex_};
  for (const Group& group : groups_) {
    for (const Served& served : group.served) {
      if (served.internal) served.internal->rest();
    }
  }
}

std::vector<cie::scheduling::AnnouncedThread> RclcppNode::workers() const {
  return {{.name = "cie-rclcpp", .trace = server_->thread.thread()}};
}

// --- groups ---------------------------------------------------------------------------------------

void RclcppNode::claim(Group group) {
  const auto claimed = group.group.lock();
  if (claimed->get_associated_with_executor_atomic().exchange(true)) {
    throw std::runtime_error{"Callback group has already been added to an executor."};
  }
  groups_.push_back(std::move(group));
}

void RclcppNode::add_whole() {
  const auto node = node_.lock();
  if (node->get_associated_with_executor_atomic().exchange(true)) {
    throw std::runtime_error{"Node '" + name_ + "' has already been added to an executor."};
  }
  const std::lock_guard lock{mutex_};
  is_whole_ = true;
  if (auto* const notice = notice_of_node(*node)) listen(*notice, on_change_);
}

void RclcppNode::add_group(const rclcpp::CallbackGroup::SharedPtr& group) {
  const std::lock_guard lock{mutex_};
  Group added{.group = group, .added = Added::by_hand};
  if (const auto node = node_.lock()) added.notice = notice_of(*group, node->get_context());
  claim(std::move(added));
  if (const auto notice = groups_.back().notice.lock()) listen(*notice, on_change_);
}

template <typename Condition>
Callbacks RclcppNode::release_groups(Condition condition) {
  std::vector<Group> released;
  {
    const std::lock_guard lock{mutex_};
    const auto stay = std::stable_partition(groups_.begin(), groups_.end(),
                                            [&](const Group& group) { return !condition(group); });
    std::move(stay, groups_.end(), std::back_inserter(released));
    groups_.erase(stay, groups_.end());
  }
  Callbacks callbacks;
  for (Group& group : released) {
    if (const auto notice = group.notice.lock()) notice->set_on_trigger_callback(nullptr);
    if (const auto alive = group.group.lock()) {
      alive->get_associated_with_executor_atomic().store(false);
    }
    for (Served& served : group.served) {
      if (served.callback) callbacks.push_back(std::move(served.callback));
    }
  }
  return callbacks;
}

Callbacks RclcppNode::remove_whole() {
  {
    const std::lock_guard lock{mutex_};
    if (!is_whole_) return {};
    is_whole_ = false;
  }
  if (const auto node = node_.lock()) {
    if (auto* const notice = notice_of_node(*node)) notice->set_on_trigger_callback(nullptr);
    node->get_associated_with_executor_atomic().store(false);
  }
  return release_groups([](const Group& group) { return group.added == Added::with_node; });
}

Callbacks RclcppNode::remove_group(const rclcpp::CallbackGroup& group) {
  return release_groups([&group](const Group& each) { return each.group.lock().get() == &group; });
}

Callbacks RclcppNode::remove_all() {
  auto callbacks = remove_whole();
  const auto others = release_groups([](const Group&) { return true; });
  callbacks.insert(callbacks.end(), others.begin(), others.end());
  return callbacks;
}

bool RclcppNode::is_whole() const {
  const std::lock_guard lock{mutex_};
  return is_whole_;
}

bool RclcppNode::is_empty() const {
  const std::lock_guard lock{mutex_};
  return !is_whole_ && groups_.empty();
}

std::vector<rclcpp::CallbackGroup::WeakPtr> RclcppNode::groups(Added added) const {
  const std::lock_guard lock{mutex_};
  std::vector<rclcpp::CallbackGroup::WeakPtr> found;
  for (const Group& group : groups_) {
    if (group.added == added) found.push_back(group.group);
  }
  return found;
}

// --- what came and went ---------------------------------------------------------------------------

// What took the place of something came after that had gone: so what is there is looked at first.
RclcppNode::Changes RclcppNode::look(const LetGo& let_go) {
  Changes changes;
  std::vector<Contents> all;
  {
    const std::lock_guard lock{mutex_};
    if (is_whole_) find_groups();
    for (const Group& group : groups_)
      all.push_back(contents_of(group.group));
    find_gone(changes);
  }
  if (let_go && !changes.gone.empty()) let_go(changes.gone);
  const std::lock_guard lock{mutex_};
  for (const Contents& contents : all)
    serve_new(contents, changes);
  return changes;
}

void RclcppNode::find_gone(Changes& changes) {
  for (Group& group : groups_) {
    const bool has_gone = group.group.expired();
    std::erase_if(group.served, [&](Served& served) {
      if (!has_gone && !served.entity.expired()) return false;
      if (served.callback) changes.gone.push_back(std::move(served.callback));
      if (served.internal) changes.ended.push_back(std::move(served.internal));
      return true;
    });
  }
  std::erase_if(groups_,
                [](const Group& group) { return group.served.empty() && group.group.expired(); });
  std::erase_if(leaving_, [](const auto& callback) { return callback.expired(); });
  leaving_.insert(leaving_.end(), changes.gone.begin(), changes.gone.end());
}

Callbacks RclcppNode::leaving() const {
  const std::lock_guard lock{mutex_};
  Callbacks leaving;
  for (const auto& callback : leaving_) {
    if (auto alive = callback.lock()) leaving.push_back(std::move(alive));
  }
  return leaving;
}

void RclcppNode::find_groups() {
  const auto node = node_.lock();
  if (!node) return;
  node->for_each_callback_group([this](const rclcpp::CallbackGroup::SharedPtr& group) {
    if (!group->automatically_add_to_executor_with_node() ||
        group->get_associated_with_executor_atomic().load()) {
      return;
    }
    claim({.group = group});
  });
}

template <typename Entities, typename Serve>
void RclcppNode::serve_each(Group& group, const Entities& entities, Changes& changes, Serve serve) {
  for (const auto& each : entities) {
    const bool is_known = std::ranges::any_of(
        group.served, [&](const Served& served) { return is_same(served.entity, each); });
    const auto entity = each.lock();
    if (is_known || !entity) continue;
    std::optional<Served> served;
    try {
      served = serve(entity);
      if (!served) {
        changes.is_partial = true;
        continue;
      }
    } catch (const std::exception& error) {
      // A waitable that cannot tell that it is ready, for example. Once, because it is known now.
      RCLCPP_ERROR(
          rclcpp::get_logger("cie_rclcpp"),
          "a callback of node %s is not served, because rclcpp cannot tell when it is ready: "
          "%s",
          name_.c_str(), error.what());
      served.emplace();
    }
    served->entity = entity;
    group.served.push_back(std::move(*served));
  }
}

void RclcppNode::serve_new(const Contents& contents, Changes& changes) {
  const auto found = std::ranges::find_if(
      groups_, [&](const Group& group) { return is_same(group.group, contents.group); });
  const auto alive = contents.group.lock();
  if (found == groups_.end() || !alive) return;
  auto& group = *found;
  const std::size_t before = group.served.size();
  // Where rclcpp's own subscriptions are, which it makes before any of the user's.
  const auto node = node_.lock();
  const bool is_default = node && node->get_default_callback_group() == alive;
  serve_each(group, contents.timers, changes,
             [&](const auto& timer) { return as_timer(group, timer); });
  serve_each(group, contents.subscriptions, changes, [&](const auto& subscription) {
    const std::string_view topic = subscription->get_topic_name();
    const bool is_own =
        is_default && (topic == "/clock" || (topic == "/parameter_events" &&
                                             !std::exchange(group.has_own_events, true)));
    return is_own ? as_internal(make_entity(subscription))
                  : as_callback(group, make_entity(subscription));
  });
  serve_each(group, contents.services, changes, [&](const auto& service) {
    const std::string name = service->get_service_name();
    return is_of_node(name, kParameterServices) ||
                   (is_default && is_of_node(name, kLifecycleServices) &&
                    has_lifecycle_services(contents))
               ? as_internal(make_entity(service))
               : as_callback(group, make_entity(service));
  });
  serve_each(group, contents.clients, changes,
             [&](const auto& client) { return as_callback(group, make_entity(client)); });
  const auto of_subscription = [](const auto& each) {
    const auto waitable = each.lock();
    return !waitable || is_of_subscription(*waitable);
  };
  auto waitables = contents.waitables;
  std::erase_if(waitables, of_subscription);
  serve_each(group, waitables, changes, [&](const auto& waitable) {
    auto entity = make_entity(waitable, owner_of(waitable, contents.subscriptions));
    return is_default_event_handler(*waitable) ? as_internal(std::move(entity))
                                               : as_callback(group, std::move(entity));
  });
  for (std::size_t i = before; i < group.served.size(); ++i) {
    if (group.served[i].callback) changes.came.push_back(group.served[i].callback);
  }
}

bool RclcppNode::is_of_node(std::string_view service,
                            std::span<const std::string_view> names) const {
  return service.size() > name_.size() + 1 && service.starts_with(name_) &&
         service[name_.size()] == '/' &&
         std::ranges::find(names, service.substr(name_.size() + 1)) != names.end();
}

// A node of the user's may have a service of one of these names. Asked of services that have just come
// alone: a LifecycleNode that ends frees what its services' names are in before the services.
bool RclcppNode::has_lifecycle_services(const Contents& contents) const {
  const auto has = [&](std::string_view name) {
    return std::ranges::any_of(contents.services, [&](const auto& each) {
      const auto service = each.lock();
      return service && is_of_node(service->get_service_name(), {&name, 1});
    });
  };
  return std::ranges::all_of(kLifecycleServices, has);
}

// --- as callbacks ---------------------------------------------------------------------------------

std::shared_ptr<GroupState> RclcppNode::state_of(Group& group) {
  if (!group.state) {
    const bool is_reentrant = group.group.lock()->type() == rclcpp::CallbackGroupType::Reentrant;
    group.state = std::make_shared<GroupState>(
        trace_.id(), is_reentrant ? GroupType::reentrant : GroupType::mutually_exclusive);
  }
  return group.state;
}

bool RclcppNode::is_leaving(const Group& group, const std::string& logical_id) const {
  constexpr long kOurs = 1;  // what a run holds
  if (!group.state || group.state->type() == GroupType::reentrant) return false;
  const auto has_id = [&logical_id](const cie::scheduling::Callback& callback) {
    return cie::LogicalId::without_number(callback.logical_id()) == logical_id;
  };
  const bool is_held_by_run = std::ranges::any_of(group.served, [&](const Served& served) {
    return served.callback && has_id(*served.callback) && served.callback->is_running() &&
           served.entity.use_count() <= kOurs;
  });
  return is_held_by_run || std::ranges::any_of(leaving_, [&](const auto& leaving) {
           const auto callback = leaving.lock();
           return callback && &callback->group() == group.state.get() && has_id(*callback) &&
                  callback->is_closed() && callback->is_running();
         });
}

std::optional<RclcppNode::Served> RclcppNode::as_callback(Group& group,
                                                          std::unique_ptr<Entity> entity) {
  const auto state = state_of(group);
  cie::trace::CallbackInfo info{.group = state->id(), .node = trace_.id(), .kind = entity->kind()};
  const std::string name = entity->name();
  const std::string id = cie::logical_id(name_, info.kind, name);
  if (is_leaving(group, id)) return std::nullopt;
  info.logical_id = cie::trace::unique_logical_id(id);
  info.source = name;
  info.queue_depth = static_cast<std::uint32_t>(entity->depth());
  return Served{.callback = std::make_shared<EntityCallback>(
                    state, std::move(info), std::move(entity), server_->admission, on_change_)};
}

std::optional<RclcppNode::Served> RclcppNode::as_timer(Group& group,
                                                       const rclcpp::TimerBase::SharedPtr& timer) {
  const auto state = state_of(group);
  const std::int64_t period = period_of(*timer->get_timer_handle());
  cie::trace::CallbackInfo info{
      .group = state->id(), .node = trace_.id(), .kind = CallbackKind::timer};
  const std::string id = cie::logical_id(name_, CallbackKind::timer, std::to_string(period));
  if (is_leaving(group, id)) return std::nullopt;
  info.logical_id = cie::trace::unique_logical_id(id);
  info.period_ns = static_cast<std::uint64_t>(period);
  return Served{.callback = std::make_shared<TimerCallback>(state, std::move(info), timer,
                                                            server_->admission, on_change_)};
}

std::optional<RclcppNode::Served> RclcppNode::as_internal(std::unique_ptr<Entity> entity) {
  return Served{.internal =
                    std::make_unique<InternalEndpoint>(server_, std::move(entity), on_change_)};
}

}  // namespace cie_rclcpp
