// What a Node is made of, shared with the executor that serves it.
#pragma once

#include <cie/executor/node.hpp>
#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/served_node.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds/context_state.hpp"
#include "parameters/parameter_store.hpp"
#include "scheduling_names.hpp"

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace cie::executor {

class ParameterServices;

// Thread-safe. The lock is never held while the executor's is taken.
class NodeState final : public ServedNode, public std::enable_shared_from_this<NodeState> {
 public:
  NodeState(std::shared_ptr<ContextState> context, std::string_view name,
            std::string_view name_space, const Remaps& remaps,
            const ParameterOverrides& parameters = {});

  ~NodeState() override;

  const std::string& name() const noexcept override { return name_; }
  NodeId id() const noexcept { return trace_.id(); }
  const std::shared_ptr<ContextState>& context() const noexcept { return context_; }
  const Graph::Member& graph_member() const noexcept { return graph_member_; }

  // The absolute name of a topic or service as this node means it, remaps applied. Throws
  // std::invalid_argument.
  std::string resolved(std::string_view name) const;

  // The group for a new callback: the given one, or a fresh one. Throws std::logic_error if the
  // given one belongs to another node.
  std::shared_ptr<GroupState> group_or_new(const std::shared_ptr<CallbackGroup>& group);
  std::shared_ptr<GroupState> new_group(GroupType type);

  // Takes the callbacks in and tells the executor, which serves them before this returns. If it
  // refuses (throws), they are taken out again.
  void add(const std::vector<std::shared_ptr<Callback>>& callbacks);
  std::vector<std::shared_ptr<Callback>> callbacks() const override;
  std::vector<AnnouncedThread> workers() const override { return context_->workers(); }

  // Takes the callback out and ends it. Throws std::logic_error if it is another node's.
  void remove(Callback& callback);
  // With those of its events.
  void remove(SubscriptionCallback& subscription);
  // The node goes: all its callbacks end, and it leaves its executor and the network.
  void end();

  ParameterStore& parameters() noexcept { return parameters_; }
  // Offers the parameters to the network, once. Called before the first is declared.
  void offer_parameters();
  // Ends that, for good; waits for the answer that is being given.
  void withdraw_parameters();

  void join(std::shared_ptr<ExecutorCore> executor) override;
  void leave() override;
  std::shared_ptr<ExecutorCore> executor() const;

 private:
  // On /parameter_events, while the parameters are offered.
  void publish_change(ParameterStore::Change change, const std::vector<Parameter>& parameters);

  std::shared_ptr<ContextState> context_;
  std::string name_;
  Graph::Member graph_member_;
  std::map<std::string, std::string> remaps_;  // absolute names
  trace::Node trace_;
  mutable std::mutex mutex_;
  std::vector<std::weak_ptr<GroupState>> groups_;
  std::vector<std::shared_ptr<Callback>> callbacks_;
  std::shared_ptr<ExecutorCore> executor_;
  ParameterStore parameters_;
  std::mutex services_mutex_;  // of what follows
  std::unique_ptr<ParameterServices> services_;
  bool is_withdrawn_ = false;
};

}  // namespace cie::executor
