// A thread for each callback group, and so for each callback that is alone in its own.
#pragma once

#include <cie/scheduling/placement.hpp>

#include <map>

namespace cie::scheduling {

// A reentrant group has several.
class ThreadPerGroup final : public Placement {
 public:
  ThreadPerGroup(const PlacementParts& parts, LoopFactory new_loop)
      : parts_(parts), new_loop_(std::move(new_loop)) {}

  bool is_on_thread_of(const Callbacks& callbacks) const override;
  Waiting stop() override;

 protected:
  Teams place(const Callbacks& callbacks) override;
  Vacating take_off(const Callbacks& callbacks) override;
  void reset() override { teams_.clear(); }

 private:
  TeamPtr team_of(const Callback& callback) const;
  TeamPtr start_team(const GroupState& group, const ThreadPlan& plan);

  const PlacementParts parts_;
  const LoopFactory new_loop_;
  std::map<const GroupState*, TeamPtr> teams_;
};

}  // namespace cie::scheduling
