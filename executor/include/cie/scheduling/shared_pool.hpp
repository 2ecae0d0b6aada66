// All callbacks on the threads of one pool.
#pragma once

#include <cie/scheduling/placement.hpp>

namespace cie::scheduling {

class SharedPool final : public Placement {
 public:
  SharedPool(const PlacementParts& parts, LoopFactory new_loop)
      : parts_(parts), new_loop_(std::move(new_loop)) {}

  bool is_on_thread_of(const Callbacks&) const override {
    return team_ != nullptr && team_->is_on_own_thread();
  }
  Waiting stop() override;

 protected:
  Teams place(const Callbacks& callbacks) override;
  Vacating take_off(const Callbacks& callbacks) override;
  void reset() override { team_.reset(); }

 private:
  TeamPtr start_team();

  const PlacementParts parts_;
  const LoopFactory new_loop_;
  TeamPtr team_;
};

}  // namespace cie::scheduling
