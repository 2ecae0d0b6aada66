#include <cie/scheduling/clock.hpp>

#include "distributions.hpp"
#include "executor_state.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rclcpp/node.hpp>

namespace cie_rclcpp {
namespace {

using Added = RclcppNode::Added;

[[noreturn]] void throw_no_some(const char* function) {
  throw std::logic_error{std::string{"CallbackIsolatedExecutor::"} + function +
                         "(): each callback has a thread of its own, which serves it while spin() "
                         "runs. Use spin() or spin_for(), and wait for a future on another thread"};
}

}  // namespace

CallbackIsolatedExecutor::CallbackIsolatedExecutor(const rclcpp::ExecutorOptions& options)
    : CallbackIsolatedExecutor(options_from_environment(options.context), options) {}

CallbackIsolatedExecutor::CallbackIsolatedExecutor(cie::ExecutorOptions scheduling,
                                                   const rclcpp::ExecutorOptions& options)
    : rclcpp::Executor(options), state_(std::make_shared<ExecutorState>(std::move(scheduling))) {
  // Of rclcpp's own cancel(), which is not virtual in Humble, and of the end of the context.
  const auto cancel = [core = std::weak_ptr{state_->shared_core()}](std::size_t) {
    if (const auto alive = core.lock()) alive->cancel();
  };
  condition(interrupt_guard_condition_).set_on_trigger_callback(cancel);
  shutdown_guard_condition_->set_on_trigger_callback(cancel);
}

CallbackIsolatedExecutor::~CallbackIsolatedExecutor() {
  condition(interrupt_guard_condition_).set_on_trigger_callback(nullptr);
  shutdown_guard_condition_->set_on_trigger_callback(nullptr);
  state_->core().cancel();
  state_->wait_until_left();
}

void CallbackIsolatedExecutor::add_node(PassedNodeBase node, bool) { state_->add_node(node); }
void CallbackIsolatedExecutor::add_node(PassedNode node, bool notify) {
  add_node(node->get_node_base_interface(), notify);
}
void CallbackIsolatedExecutor::remove_node(PassedNodeBase node, bool) {
  state_->remove_node(*node);
}
void CallbackIsolatedExecutor::remove_node(PassedNode node, bool notify) {
  remove_node(node->get_node_base_interface(), notify);
}
void CallbackIsolatedExecutor::add_callback_group(PassedGroup group, PassedNodeBase node, bool) {
  state_->add_group(group, node);
}
void CallbackIsolatedExecutor::remove_callback_group(PassedGroup group, bool) {
  state_->remove_group(*group);
}

std::vector<rclcpp::CallbackGroup::WeakPtr> CallbackIsolatedExecutor::get_all_callback_groups() {
  auto all = state_->groups(Added::by_hand);
  const auto automatic = state_->groups(Added::with_node);
  all.insert(all.end(), automatic.begin(), automatic.end());
  return all;
}
std::vector<rclcpp::CallbackGroup::WeakPtr>
CallbackIsolatedExecutor::get_manually_added_callback_groups() {
  return state_->groups(Added::by_hand);
}
std::vector<rclcpp::CallbackGroup::WeakPtr>
CallbackIsolatedExecutor::get_automatically_added_callback_groups_from_nodes() {
  return state_->groups(Added::with_node);
}

void CallbackIsolatedExecutor::spin() { spin_until(cie::scheduling::kNever); }
void CallbackIsolatedExecutor::spin_for(std::chrono::nanoseconds duration) {
  const std::int64_t now = cie::scheduling::monotonic_now();
  const std::int64_t most = cie::scheduling::kNever - now;
  spin_until(now + std::min<std::int64_t>(duration.count(), most));
}

void CallbackIsolatedExecutor::spin_until(std::int64_t deadline_ns) {
  const auto state = state_;  // lives until this thread has left
  const ExecutorState::Inside inside{*state};
  if (spinning.exchange(true)) throw std::runtime_error{"spin() called while already spinning"};
  const struct Spinning {
    std::atomic_bool& flag;
    ~Spinning() { flag.store(false); }
  } until_return{spinning};
  if (rclcpp::ok(context_)) state->spin(deadline_ns);
}

void CallbackIsolatedExecutor::spin_some(std::chrono::nanoseconds) { throw_no_some("spin_some"); }
void CallbackIsolatedExecutor::spin_all(std::chrono::nanoseconds) { throw_no_some("spin_all"); }
void CallbackIsolatedExecutor::spin_once(std::chrono::nanoseconds) { throw_no_some("spin_once"); }
void CallbackIsolatedExecutor::spin_once_impl(std::chrono::nanoseconds) {
  throw_no_some("spin_until_future_complete");
}

void CallbackIsolatedExecutor::spawn_thread(const std::string& name,
                                            std::function<void(std::stop_token)> function) {
  state_->core().spawn_thread(name, std::move(function));
}
void CallbackIsolatedExecutor::reload_spec(std::shared_ptr<const cie::SchedulingSpec> spec) {
  state_->core().reload_spec(std::move(spec));
}
std::vector<cie::SchedulingProblem> CallbackIsolatedExecutor::scheduling_problems() const {
  return state_->core().problems();
}

}  // namespace cie_rclcpp
