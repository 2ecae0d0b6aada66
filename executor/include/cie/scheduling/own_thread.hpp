// All callbacks on the thread that spins.
#pragma once

#include <cie/scheduling/placement.hpp>
#include <cie/scheduling/threads.hpp>

#include <cstdint>
#include <memory>
#include <optional>

namespace cie::scheduling {

class OwnThread : public Placement {
 public:
  explicit OwnThread(std::unique_ptr<Loop> loop) : loop_(std::move(loop)) {}

  bool is_on_thread_of(const Callbacks&) const override { return loop_->is_on_own_thread(); }
  Waiting stop() override;
  bool is_on_spinning_thread() const noexcept override { return true; }
  void run(std::int64_t deadline_ns, Cancellation&) override { loop_->run(deadline_ns); }
  void cancel() noexcept override { loop_->wake(); }

 protected:
  Teams place(const Callbacks& callbacks) override;
  Vacating take_off(const Callbacks& callbacks) override;
  void reset() override { spinning_.reset(); }
  Loop& loop() noexcept { return *loop_; }

 private:
  const std::unique_ptr<Loop> loop_;
  std::optional<ThreadsId> spinning_;  // which begins a spin by placing what there is
};

}  // namespace cie::scheduling
