// A subscription, service, client or waitable of rclcpp as a callback that an executor of cie runs.
#pragma once

#include <cie/scheduling/callback.hpp>
#include <cie/scheduling/clock.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "admission.hpp"
#include "entity.hpp"
#include "inbox.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

namespace cie_rclcpp {

// Told, from any thread, that an entity may have gone. It must neither block nor throw.
using OnGone = std::function<void()>;

class EntityCallback final : public cie::scheduling::Callback, public Admitted {
 public:
  // Listens from now on. Throws what rclcpp throws.
  EntityCallback(std::shared_ptr<cie::scheduling::GroupState> group, cie::trace::CallbackInfo info,
                 std::unique_ptr<Entity> entity, std::shared_ptr<Admission> admission,
                 const OnGone& on_gone);
  ~EntityCallback() override { end(); }

  std::int64_t next_due() const noexcept override { return cie::scheduling::kNever; }
  void serve(cie::scheduling::ReadySink* sink) override;
  std::uint64_t queued() const noexcept override { return is_admitted() ? inbox_->queued() : 0; }
  std::uint64_t waiting() const noexcept override { return inbox_->waiting(); }
  std::int64_t ready_at() const noexcept override { return inbox_->ready_at(); }
  void wake() noexcept override { inbox_->wake(); }

 private:
  bool run_one() override;
  void on_failure_handled() noexcept override { leave_after_failure(); }
  void dispose() noexcept override;
  cie::trace::Callback::Release release_by(const Inbox::Taken& taken,
                                           std::int64_t source_timestamp_ns) noexcept;

  void tell_lost() noexcept;

  const std::unique_ptr<Entity> entity_;
  const std::shared_ptr<Inbox> inbox_;
  cie::PriorityMutex taking_;  // an announcement and its message, one thread after the other
  bool is_shifted_ = false;    // messages may be of later announcements, until none is left
};

// Calls `on_gone` when the last copy of it goes.
std::shared_ptr<void> farewell(OnGone on_gone);

}  // namespace cie_rclcpp
