// What CallbackIsolatedExecutor is made of.
#pragma once

#include <cie/scheduling/executor_core.hpp>
#include <cie/scheduling/wakeup.hpp>

#include "internal_endpoint.hpp"
#include "rclcpp_node.hpp"
#include "session.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <stop_token>
#include <utility>
#include <vector>

#include <rclcpp/future_return_code.hpp>

namespace cie_rclcpp {

// Which nodes and groups belong to it, and what of them is served. Thread-safe.
class ExecutorState {
 public:
  explicit ExecutorState(cie::ExecutorOptions options);
  ExecutorState(const ExecutorState&) = delete;
  ExecutorState& operator=(const ExecutorState&) = delete;
  ~ExecutorState();

  void add_node(const NodeBase::SharedPtr& node);
  void remove_node(const NodeBase& node);
  void add_group(const rclcpp::CallbackGroup::SharedPtr& group, const NodeBase::SharedPtr& node);
  void remove_group(const rclcpp::CallbackGroup& group);
  std::vector<rclcpp::CallbackGroup::WeakPtr> groups(RclcppNode::Added added) const;

  void spin(std::int64_t deadline_ns);
  // Callbacks run on their threads here as well; none does when these return. What waited at the call;
  // whether there was something, and who serves goes on.
  bool spin_some(std::int64_t deadline_ns);
  // Again and again, until nothing waits.
  void spin_all(std::int64_t deadline_ns);
  // One instance of what waits longest, or of what comes first.
  void spin_once(std::int64_t deadline_ns);
  // Everything, until `wait_for_future` says so.
  using WaitForFuture = std::function<std::future_status(std::chrono::nanoseconds)>;
  rclcpp::FutureReturnCode spin_until(std::int64_t deadline_ns,
                                      const WaitForFuture& wait_for_future);
  // A caller that is inside uses the executor until it has left.
  class Inside {
   public:
    explicit Inside(ExecutorState& state) : state_(state) { ++state_.inside_; }
    Inside(const Inside&) = delete;
    Inside& operator=(const Inside&) = delete;
    ~Inside() {
      --state_.inside_;
      state_.inside_.notify_all();
    }

   private:
    ExecutorState& state_;
  };
  // From here to its end the calling thread spins; afterwards what rclcpp serves for itself rests.
  class Spinning {
   public:
    explicit Spinning(ExecutorState& state) : state_(state) {}
    Spinning(const Spinning&) = delete;
    Spinning& operator=(const Spinning&) = delete;
    ~Spinning() { state_.rest(); }

   private:
    ExecutorState& state_;
  };
  void wait_until_left() const noexcept {
    for (int inside = inside_.load(); inside != 0; inside = inside_.load())
      inside_.wait(inside);
  }
  cie::scheduling::ExecutorCore& core() noexcept { return *core_; }
  // What ends a spin, also when the executor has gone. No callback begins when it has returned.
  std::function<void()> cancel() const;

 private:
  using NodePtr = std::shared_ptr<RclcppNode>;

  // Adds a part of a node to its member, which is made and told to the core if there is none.
  template <typename Add>
  void add(const NodeBase::SharedPtr& node, Add add);
  NodePtr find(const NodeBase& node) const;  // null: none; with mutex_ held
  // Takes callbacks off their threads, and the node off the executor if nothing of it is left.
  void vacate(const NodePtr& node, const Callbacks& callbacks);
  void drop_if_empty(const NodePtr& node);
  // Whether nothing is left to look at again.
  bool look_at_all();
  void watch(const std::stop_token& stop);
  // Finds what there is, and has what comes found.
  void prepare();
  void rest() noexcept;
  std::vector<NodePtr> nodes() const;
  std::vector<std::shared_ptr<Admitted>> all_admitted() const;
  void wake_all();
  // Lets these in, and waits until they have run. False: somebody cancelled.
  bool run_round(const std::vector<std::pair<std::shared_ptr<Admitted>, std::uint64_t>>& waiting,
                 std::int64_t deadline_ns);

  const std::shared_ptr<cie::scheduling::Wakeup> changed_;
  const std::shared_ptr<cie::scheduling::ExecutorCore> core_;
  const std::shared_ptr<InternalServer> server_;
  const std::shared_ptr<Admission> admission_ = server_->admission;
  mutable std::mutex mutex_;  // of what follows
  std::vector<NodePtr> nodes_;
  std::once_flag watching_;
  std::atomic<int> inside_{0};
  Session session_;
};

}  // namespace cie_rclcpp
