#include <cie/scheduling/clock.hpp>

#include "distributions.hpp"
#include "executor_state.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include <cie_rclcpp/callback_isolated_executor.hpp>
#include <rclcpp/node.hpp>

namespace cie_rclcpp {
namespace {

using Added = RclcppNode::Added;

constexpr std::chrono::nanoseconds kForever{-1};

// CLOCK_MONOTONIC; of less than 0: never.
std::int64_t deadline_after(std::chrono::nanoseconds duration) {
  constexpr std::int64_t kNever = cie::scheduling::kNever;
  const std::int64_t now = cie::scheduling::monotonic_now();
  return duration.count() < 0 ? kNever
                              : now + std::min<std::int64_t>(duration.count(), kNever - now);
}

}  // namespace

CallbackIsolatedExecutor::CallbackIsolatedExecutor(const rclcpp::ExecutorOptions& options)
    : CallbackIsolatedExecutor(options_from_environment(options.context), options) {}

CallbackIsolatedExecutor::CallbackIsolatedExecutor(cie::ExecutorOptions scheduling,
                                                   const rclcpp::ExecutorOptions& options)
    : rclcpp::Executor(options), state_(std::make_shared<ExecutorState>(std::move(scheduling))) {
  // Of rclcpp's own cancel(), which is not virtual in Humble, and of the end of the context.
  const auto cancel = [end = state_->cancel()](std::size_t) { end(); };
  condition(interrupt_guard_condition_).set_on_trigger_callback(cancel);
  shutdown_guard_condition_->set_on_trigger_callback(cancel);
}

CallbackIsolatedExecutor::~CallbackIsolatedExecutor() {
  condition(interrupt_guard_condition_).set_on_trigger_callback(nullptr);
  shutdown_guard_condition_->set_on_trigger_callback(nullptr);
  state_->cancel()();
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

// A thread that spins, and that no second one joins.
template <typename Spin>
void CallbackIsolatedExecutor::spin_as(const char* function, Spin serve) {
  const auto state = state_;  // lives until this thread has left
  const ExecutorState::Inside inside{*state};
  if (spinning.exchange(true)) {
    throw std::runtime_error{std::string{function} + "() called while already spinning"};
  }
  const struct Spinning {
    std::atomic_bool& flag;
    ~Spinning() { flag.store(false); }
  } until_return{spinning};
  const ExecutorState::Spinning until_then{*state};
  if (rclcpp::ok(context_)) serve(*state);
}

void CallbackIsolatedExecutor::spin() {
  spin_as("spin", [](ExecutorState& state) { state.spin(cie::scheduling::kNever); });
}
void CallbackIsolatedExecutor::spin_for(std::chrono::nanoseconds duration) {
  const auto deadline = deadline_after(std::max(duration, std::chrono::nanoseconds{0}));
  spin_as("spin", [deadline](ExecutorState& state) { state.spin(deadline); });
}

// 0: as long as it takes.
void CallbackIsolatedExecutor::spin_some(std::chrono::nanoseconds max_duration) {
  const auto deadline = deadline_after(max_duration.count() > 0 ? max_duration : kForever);
  spin_as("spin_some", [deadline](ExecutorState& state) { state.spin_some(deadline); });
}
void CallbackIsolatedExecutor::spin_all(std::chrono::nanoseconds max_duration) {
  if (max_duration.count() < 0) {
    throw std::invalid_argument{"max_duration must be greater than or equal to 0"};
  }
  const auto deadline = deadline_after(max_duration.count() > 0 ? max_duration : kForever);
  spin_as("spin_all", [deadline](ExecutorState& state) { state.spin_all(deadline); });
}
void CallbackIsolatedExecutor::spin_once(std::chrono::nanoseconds timeout) {
  const auto deadline = deadline_after(timeout);
  spin_as("spin_once", [deadline](ExecutorState& state) { state.spin_once(deadline); });
}

// Of rclcpp's own loop until a future is complete, which Humble has instead of the next.
void CallbackIsolatedExecutor::spin_once_impl(std::chrono::nanoseconds timeout) {
  const auto state = state_;
  const ExecutorState::Inside inside{*state};
  const ExecutorState::Spinning until_then{*state};
  state->spin_once(deadline_after(timeout));
}
rclcpp::FutureReturnCode CallbackIsolatedExecutor::spin_until_future_complete_impl(
    std::chrono::nanoseconds timeout,
    const std::function<std::future_status(std::chrono::nanoseconds wait_time)>& wait_for_future) {
  constexpr std::chrono::nanoseconds kNow{0};
  if (wait_for_future(kNow) == std::future_status::ready) {
    return rclcpp::FutureReturnCode::SUCCESS;
  }
  const auto deadline = deadline_after(timeout);
  auto outcome = rclcpp::FutureReturnCode::INTERRUPTED;
  spin_as("spin_until_future_complete",
          [&](ExecutorState& state) { outcome = state.spin_until(deadline, wait_for_future); });
  return outcome;
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
