// An executor for rclcpp: every callback group on a thread of its own, scheduled by Linux as a spec
// says, and traced with cie's events.
#pragma once

#include <cie/scheduling/failure.hpp>
#include <cie/scheduling/options.hpp>
#include <cie/scheduling/problem.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <ratio>
#include <stop_token>
#include <string>
#include <type_traits>
#include <vector>

#include <rclcpp/executor.hpp>
#include <rclcpp/version.h>

namespace cie_rclcpp {

class ExecutorState;

namespace detail {

// How rclcpp::Executor passes what is added and removed: until Kilted by value, then by reference.
template <typename Function>
struct Parameter;
template <typename T>
struct Parameter<void (rclcpp::Executor::*)(T, bool)> {
  using Type = T;
};
template <typename T>
using Passed = std::conditional_t<std::is_reference_v<typename Parameter<
                                      decltype(&rclcpp::Executor::remove_callback_group)>::Type>,
                                  const T&, T>;

}  // namespace detail

// What says how an application's threads run, without a change of it. The spec's file is the ROS
// parameter `cie_spec` of the command line (`--ros-args -p cie_spec:=FILE`), else the environment's
// CIE_SPEC. `cie_on_error` or CIE_ON_ERROR is `refuse` (the default) or `warn`, and what is
// wrong with threads' parameters is logged. Throws
// cie::SpecError for a file that cannot be used, std::invalid_argument for another word.
cie::ExecutorOptions options_from_environment(
    const rclcpp::Context::SharedPtr& context = rclcpp::contexts::get_global_default_context());

// Takes the place of rclcpp::executors::MultiThreadedExecutor or of a callback-isolated executor.
// A mutually exclusive group has one thread, a reentrant one ExecutorOptions::reentrant_threads.
// Each thread names itself, gets the scheduling parameters of its spec entry and reads them back
// before its first callback. What rclcpp serves for itself (parameter services, /parameter_events,
// /clock, default handlers of incompatible QoS) runs on the thread "cie-rclcpp", which a spec can
// name, so that a group with one callback of the user's has one callback.
//
// Arrivals and releases are known from the middleware's own notices. An entity's notices go to one
// executor alone: do not set set_on_new_message_callback() and the like yourself.
//
// Thread-safe but for construction and destruction. Functions throw as those of rclcpp::Executor;
// beyond that spin() throws cie::SchedulingRefused where the kernel refuses parameters under
// OnError::refuse, and cie::CallbackError when a callback throws, or when what was created while it
// spins is refused.
class CallbackIsolatedExecutor final : public rclcpp::Executor {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(CallbackIsolatedExecutor)

  // With options_from_environment().
  explicit CallbackIsolatedExecutor(
      const rclcpp::ExecutorOptions& options = rclcpp::ExecutorOptions());
  explicit CallbackIsolatedExecutor(
      cie::ExecutorOptions scheduling,
      const rclcpp::ExecutorOptions& options = rclcpp::ExecutorOptions());
  // Cancels, and waits until spin() has returned; not in a callback of its own.
  ~CallbackIsolatedExecutor() override;

  using NodeBase = rclcpp::node_interfaces::NodeBaseInterface;
  using PassedNodeBase = detail::Passed<NodeBase::SharedPtr>;
  using PassedNode = detail::Passed<std::shared_ptr<rclcpp::Node>>;
  using PassedGroup = detail::Passed<rclcpp::CallbackGroup::SharedPtr>;

  // Members, also while spinning. A node's groups, callbacks and timers that are created later are
  // found and served from then on. What a thread of a removed node's is doing is waited for.
  void add_node(PassedNodeBase node, bool notify = true) override;
  void add_node(PassedNode node, bool notify = true) override;
  void remove_node(PassedNodeBase node, bool notify = true) override;
  void remove_node(PassedNode node, bool notify = true) override;
  void add_callback_group(PassedGroup group, PassedNodeBase node, bool notify = true) override;
  void remove_callback_group(PassedGroup group, bool notify = true) override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_all_callback_groups() override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_manually_added_callback_groups() override;
  std::vector<rclcpp::CallbackGroup::WeakPtr> get_automatically_added_callback_groups_from_nodes()
      override;

  // Serves until cancel() or until the context is shut down (SIGINT, for example).
  void spin() override;
  // The same for at most `duration`. Threads begin and end with each call.
  void spin_for(std::chrono::nanoseconds duration);
  // These run callbacks on their own threads, too, those of different groups at once, and return as
  // rclcpp's do: when all that waited at the call has run, when nothing waits any more, when one has.
  // None runs then. Their threads stay for the next such call, until spin(), cancel() or the end.
  void spin_some(std::chrono::nanoseconds max_duration = std::chrono::nanoseconds{0}) override;
  void spin_all(std::chrono::nanoseconds max_duration) override;
  void spin_once(std::chrono::nanoseconds timeout = std::chrono::nanoseconds{-1}) override;
#if RCLCPP_VERSION_MAJOR < 28
  // Instead of rclcpp's, which is no virtual function in Humble and serves one callback at a time; so
  // it does where it is called by a reference to rclcpp::Executor.
  template <typename Future, typename Rep = std::int64_t, typename Period = std::milli>
  rclcpp::FutureReturnCode spin_until_future_complete(
      const Future& future,
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>{-1}) {
    return spin_until_future_complete_impl(
        std::chrono::duration_cast<std::chrono::nanoseconds>(timeout),
        [&future](std::chrono::nanoseconds time) { return future.wait_for(time); });
  }
#endif

  // A thread of the user's, configured by the spec's entry for `name` (at most 15 bytes), told to
  // stop by the executor's destructor. Throws as spin() does, and std::invalid_argument.
  void spawn_thread(const std::string& name, std::function<void(std::stop_token)> function);
  // Threads run by another spec from now on; null: by none. Under OnError::refuse all or nothing.
  void reload_spec(std::shared_ptr<const cie::SchedulingSpec> spec);
  // What is wrong with the parameters of threads, so far.
  std::vector<cie::SchedulingProblem> scheduling_problems() const;

 protected:
  void spin_once_impl(std::chrono::nanoseconds timeout) override;
  rclcpp::FutureReturnCode spin_until_future_complete_impl(
      std::chrono::nanoseconds timeout,
      const std::function<std::future_status(std::chrono::nanoseconds wait_time)>& wait_for_future)
#if RCLCPP_VERSION_MAJOR < 28
      ;
#else
      override;
#endif

 private:
  template <typename Spin>
  void spin_as(const char* function, Spin serve);

  std::shared_ptr<ExecutorState> state_;
};

}  // namespace cie_rclcpp
