// A node of rclcpp, or some of its callback groups, as an executor of cie serves it.
#pragma once

#include <cie/scheduling/served_node.hpp>
#include <cie/tracepoints/trace.hpp>

#include "internal_endpoint.hpp"

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <rclcpp/callback_group.hpp>
#include <rclcpp/guard_condition.hpp>
#include <rclcpp/node_interfaces/node_base_interface.hpp>

namespace cie_rclcpp {

using NodeBase = rclcpp::node_interfaces::NodeBaseInterface;
using Callbacks = std::vector<std::shared_ptr<cie::scheduling::Callback>>;

// Users create callbacks with rclcpp and drop them; look() finds out. Thread-safe.
class RclcppNode final : public cie::scheduling::ServedNode {
 public:
  // `on_change` is told, from any thread, that it is worth to look.
  RclcppNode(const NodeBase::SharedPtr& node, std::shared_ptr<InternalServer> server,
             OnGone on_change);
  ~RclcppNode() override;

  const std::string& name() const noexcept override { return name_; }
  Callbacks callbacks() const override;
  std::vector<cie::scheduling::AnnouncedThread> workers() const override;
  void join(std::shared_ptr<cie::scheduling::ExecutorCore>) override {}
  void leave() override {}

  bool is_of(const NodeBase& node) const { return node_.lock().get() == &node; }
  bool has_gone() const { return node_.expired(); }

  // All groups that go with the node, now and later. Throws std::runtime_error, in rclcpp's words, if
  // the node has an executor.
  void add_whole();
  // One group. Likewise.
  void add_group(const rclcpp::CallbackGroup::SharedPtr& group);
  // Undoes these; returns the callbacks that are no longer served, which the caller ends.
  Callbacks remove_whole();
  Callbacks remove_group(const rclcpp::CallbackGroup& group);
  Callbacks remove_all();
  bool is_whole() const;
  bool is_empty() const;  // nothing was added, or everything removed

  // What a group has. Who drops something meanwhile ends it.
  struct Contents {
    std::weak_ptr<rclcpp::CallbackGroup> group;
    std::vector<rclcpp::SubscriptionBase::WeakPtr> subscriptions{};
    std::vector<rclcpp::ServiceBase::WeakPtr> services{};
    std::vector<rclcpp::ClientBase::WeakPtr> clients{};
    std::vector<rclcpp::TimerBase::WeakPtr> timers{};
    std::vector<rclcpp::Waitable::WeakPtr> waitables{};
  };
  // What came and went since the last time. Letting go of it may run users' destructors, and so is the
  // caller's part, without a lock.
  struct Changes {
    Callbacks came;
    Callbacks gone;
    std::vector<std::unique_ptr<InternalEndpoint>> ended;
    bool is_partial = false;  // something that came is told later: look again, within a millisecond
  };
  // `let_go` is called with what has gone, without a lock, before what came gets its logical ids: what
  // takes the place of something may have the same.
  using LetGo = std::function<void(const Callbacks& gone)>;
  Changes look(const LetGo& let_go = {});
  // All that is served here, in which instances may wait.
  std::vector<std::shared_ptr<Admitted>> admitted() const;
  // What rclcpp serves for itself listens, or rests: see InternalEndpoint.
  void listen_internally();
  void rest_internally() noexcept;
  // Those that look() told as gone and that still live: they may run until now.
  Callbacks leaving() const;

  enum class Added : std::uint8_t { by_hand, with_node };
  std::vector<rclcpp::CallbackGroup::WeakPtr> groups(Added added) const;

 private:
  // Something of a group that is served: as a callback, or internally.
  struct Served {
    std::weak_ptr<void> entity{};
    std::shared_ptr<cie::scheduling::Callback> callback{};
    std::unique_ptr<InternalEndpoint> internal{};
  };
  struct Group {
    std::weak_ptr<rclcpp::CallbackGroup> group;
    Added added = Added::with_node;
    std::weak_ptr<rclcpp::GuardCondition> notice{};        // of a group that was added by hand
    std::shared_ptr<cie::scheduling::GroupState> state{};  // from its first callback on
    std::vector<Served> served{};
    bool has_own_events = false;  // rclcpp's subscription to /parameter_events was found
  };

  // All with mutex_ held.
  void claim(Group group);
  void find_groups();
  void find_gone(Changes& changes);
  void serve_new(const Contents& contents, Changes& changes);
  // `serve` is given each of the entities that is new and still lives.
  template <typename Entities, typename Serve>
  void serve_each(Group& group, const Entities& entities, Changes& changes, Serve serve);
  std::shared_ptr<cie::scheduling::GroupState> state_of(Group& group);
  // Whether a callback of that logical id was dropped and runs still, in a group that runs one at a
  // time: what takes its place cannot run before that has ended, and has its id then.
  bool is_leaving(const Group& group, const std::string& logical_id) const;
  // Empty: not yet.
  std::optional<Served> as_callback(Group& group, std::unique_ptr<Entity> entity);
  std::optional<Served> as_timer(Group& group, const rclcpp::TimerBase::SharedPtr& timer);
  std::optional<Served> as_internal(std::unique_ptr<Entity> entity);
  // The service is one of these of the node.
  bool is_of_node(std::string_view service, std::span<const std::string_view> names) const;
  bool has_lifecycle_services(const Contents& contents) const;
  template <typename Condition>
  Callbacks release_groups(Condition condition);

  const std::weak_ptr<NodeBase> node_;
  const std::string name_;
  const std::shared_ptr<InternalServer> server_;
  const OnGone on_change_;
  cie::trace::Node trace_;
  mutable std::mutex mutex_;  // of what follows
  bool is_whole_ = false;
  std::vector<Group> groups_;
  std::vector<std::weak_ptr<cie::scheduling::Callback>> leaving_;
};

}  // namespace cie_rclcpp
