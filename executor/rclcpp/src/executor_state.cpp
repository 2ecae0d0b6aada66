#include "executor_state.hpp"

#include <cie/scheduling/clock.hpp>
#include <cie/scheduling/placement.hpp>
#include <cie/scheduling/thread_per_group.hpp>

#include <algorithm>
#include <exception>
#include <stdexcept>
#include <utility>

namespace cie_rclcpp {
namespace {

using cie::scheduling::ExecutorCore;
using cie::scheduling::PlacementParts;

constexpr const char* kWatcher = "cie-groups";

std::shared_ptr<ExecutorCore> make_core(cie::ExecutorOptions options) {
  return std::make_shared<ExecutorCore>(cie::ExecutorKind::isolated, std::move(options),
                                        [](const PlacementParts& parts) {
                                          return std::make_unique<cie::scheduling::ThreadPerGroup>(
                                              parts, cie::scheduling::make_lean_loop);
                                        });
}

}  // namespace

ExecutorState::ExecutorState(cie::ExecutorOptions options)
    : changed_(std::make_shared<cie::scheduling::Wakeup>()),
      core_(make_core(std::move(options))),
      server_(std::make_shared<InternalServer>()),
      session_(core_, admission_) {
  server_->on_failure = [core = std::weak_ptr{core_}](std::exception_ptr failure) {
    if (const auto alive = core.lock()) {
      alive->on_failure({.callback = cie::kNoCallback,
                         .logical_id = "cie-rclcpp",
                         .exception = std::move(failure)});
    }
  };
}

ExecutorState::~ExecutorState() {
  session_.abandon();
  cancel()();
  core_->end_spawned_threads();
  core_->drop_all_nodes();
  core_->wait_until_idle();
  server_->thread.wait_until_idle();  // whose thread would otherwise be the last to hold it
}

// --- membership -----------------------------------------------------------------------------------

ExecutorState::NodePtr ExecutorState::find(const NodeBase& node) const {
  const auto found =
      std::ranges::find_if(nodes_, [&node](const NodePtr& each) { return each->is_of(node); });
  return found == nodes_.end() ? nullptr : *found;
}

template <typename Add>
void ExecutorState::add(const NodeBase::SharedPtr& node, Add add) {
  const std::lock_guard lock{mutex_};
  const auto known = find(*node);
  const NodePtr member = known ? known
                               : std::make_shared<RclcppNode>(
                                     node, server_, [changed = changed_] { changed->notify(); });
  add(*member);
  if (!known) {
    try {
      core_->add_node(member);
    } catch (...) {
      member->remove_all();
      throw;
    }
    nodes_.push_back(member);
  }
  changed_->notify();
}

void ExecutorState::add_node(const NodeBase::SharedPtr& node) {
  add(node, [](RclcppNode& member) { member.add_whole(); });
}

void ExecutorState::add_group(const rclcpp::CallbackGroup::SharedPtr& group,
                              const NodeBase::SharedPtr& node) {
  add(node, [&group](RclcppNode& member) { member.add_group(group); });
}

void ExecutorState::remove_node(const NodeBase& node) {
  NodePtr member;
  {
    const std::lock_guard lock{mutex_};
    member = find(node);
  }
  if (!member || !member->is_whole()) {
    throw std::runtime_error{"Node needs to be associated with this executor."};
  }
  vacate(member, member->remove_whole());
}

void ExecutorState::remove_group(const rclcpp::CallbackGroup& group) {
  const auto all = nodes();
  const auto holds = [&group](const NodePtr& node) {
    return std::ranges::any_of(node->groups(RclcppNode::Added::by_hand),
                               [&group](const auto& each) { return each.lock().get() == &group; });
  };
  const auto found = std::ranges::find_if(all, holds);
  if (found == all.end()) {
    throw std::runtime_error{"Callback group needs to be associated with this executor."};
  }
  vacate(*found, (*found)->remove_group(group));
}

void ExecutorState::vacate(const NodePtr& node, const Callbacks& callbacks) {
  core_->withdraw(callbacks);
  for (const auto& callback : callbacks)
    callback->end();
  // Their groups went just before; the watcher does not wait for them.
  for (const auto& callback : node->leaving())
    callback->end();
  drop_if_empty(node);
}

void ExecutorState::drop_if_empty(const NodePtr& node) {
  {
    const std::lock_guard lock{mutex_};
    if (!node->is_empty() || std::erase(nodes_, node) == 0) return;
  }
  core_->drop_node(*node);
}

std::vector<rclcpp::CallbackGroup::WeakPtr> ExecutorState::groups(RclcppNode::Added added) const {
  const std::lock_guard lock{mutex_};
  std::vector<rclcpp::CallbackGroup::WeakPtr> all;
  for (const NodePtr& node : nodes_) {
    const auto of_node = node->groups(added);
    all.insert(all.end(), of_node.begin(), of_node.end());
  }
  return all;
}

// --- what users create and drop -------------------------------------------------------------------

std::vector<ExecutorState::NodePtr> ExecutorState::nodes() const {
  const std::lock_guard lock{mutex_};
  return nodes_;
}

bool ExecutorState::look_at_all() {
  // Not waited for: it may wait for what is to be found next.
  const auto let_go = [this](const Callbacks& gone) {
    core_->abandon(gone);
    for (const auto& callback : gone)
      callback->begin_to_end();
  };
  bool is_partial = false;
  for (const NodePtr& node : nodes()) {
    const auto changes = node->look(let_go);
    is_partial = is_partial || changes.is_partial;
    if (node->has_gone()) {  // what it leaves behind is no longer served
      let_go(node->remove_all());
      drop_if_empty(node);
    }
    if (!changes.came.empty()) core_->serve_new(*node, changes.came);
  }
  return !is_partial;
}

// What it finds wrong (a refused parameter) stops the executor, as it would have at the beginning.
void ExecutorState::watch(const std::stop_token& stop) {
  const std::stop_callback wake_up{stop, [this] { changed_->notify(); }};
  constexpr std::int64_t kSoon = 1'000'000;
  while (!stop.stop_requested()) {
    bool is_whole = true;
    try {
      is_whole = look_at_all();
    } catch (...) {
      core_->on_failure({.callback = cie::kNoCallback,
                         .logical_id = kWatcher,
                         .exception = std::current_exception()});
    }
    admission_->wake();  // who waits for what may have come
    changed_->wait_until(is_whole ? cie::scheduling::kNever
                                  : cie::scheduling::monotonic_now() + kSoon);
  }
}

void ExecutorState::prepare() {
  std::call_once(watching_, [this] {
    core_->spawn_thread(kWatcher, [this](const std::stop_token& stop) { watch(stop); });
  });
  for (const NodePtr& node : nodes())
    node->listen_internally();
  look_at_all();
}

void ExecutorState::rest() noexcept {
  for (const NodePtr& node : nodes())
    node->rest_internally();
}

}  // namespace cie_rclcpp
