#include "entity_callback.hpp"

#include <mutex>
#include <optional>
#include <utility>

namespace cie_rclcpp {

using cie::ReleaseKind;
using cie::scheduling::Callback;
using cie::scheduling::ReadySink;

std::shared_ptr<void> farewell(OnGone on_gone) {
  return {nullptr, [on_gone = std::move(on_gone)](void*) { on_gone(); }};
}

EntityCallback::EntityCallback(std::shared_ptr<cie::scheduling::GroupState> group,
                               cie::trace::CallbackInfo info, std::unique_ptr<Entity> entity,
                               const OnGone& on_gone)
    : Callback(std::move(group), std::move(info)),
      entity_(std::move(entity)),
      inbox_(std::make_shared<Inbox>(entity_->depth(), entity_->process_depth())) {
  inbox_->set_trace(&trace());
  try {
    inbox_->connect([&] {
      entity_->connect([inbox = inbox_, gone = farewell(on_gone)](Inbox::Source source,
                                                                  std::size_t count, int which) {
        inbox->announce(source, count, which);
      });
    });
  } catch (...) {
    inbox_->set_trace(nullptr);  // half of the notices may be there
    entity_->disconnect();
    throw;
  }
}

void EntityCallback::serve(ReadySink* sink) {
  inbox_->set_target(sink, this);
  if (sink != nullptr) sink->on_ready(*this);  // for what came before
}

// A message that was sent after the announcement it was taken for is a later one: the queue was full,
// and between the two it was overwritten. Where the publisher's clock is not this machine's, its
// timestamps say nothing.
cie::trace::Callback::Release EntityCallback::release_by(
    Inbox::Taken taken, std::int64_t source_timestamp_ns) noexcept {
  Arrival arrival = taken.arrival;
  const auto is_later = [&] {
    return source_timestamp_ns > 0 && arrival.monotonic_ns >= 0 &&
           source_timestamp_ns > arrival.realtime_ns;
  };
  if (is_later() && !inbox_->may_be_overwritten(taken))
    has_foreign_clock_.store(true, std::memory_order_relaxed);
  while (is_later() && !has_foreign_clock_.load(std::memory_order_relaxed)) {
    arrival = inbox_->take_later(taken.source).value_or(Arrival{});
  }
  return {.kind = ReleaseKind::data,
          .release_ns = arrival.monotonic_ns,
          .source_timestamp_realtime_ns = source_timestamp_ns};
}

void EntityCallback::tell_lost() noexcept {
  if (!inbox_->take_lost()) return;
  if (const std::uint32_t lost = entity_->take_lost(); lost > 0) trace().sample_lost(lost);
}

bool EntityCallback::run_one() {
  struct Running {
    EntityCallback& callback;
    std::unique_lock<cie::PriorityMutex> taking;
    Inbox::Taken taken{};
    std::optional<Instance> instance{};
  } running{.callback = *this, .taking = std::unique_lock{taking_}};
  tell_lost();
  const Entity::Begin begin = [&running](std::int64_t source_timestamp_ns) {
    const auto release = running.callback.release_by(running.taken, source_timestamp_ns);
    running.taking.unlock();
    running.instance.emplace(running.callback, release);
  };
  while (const auto taken = inbox_->take()) {
    running.taken = *taken;
    if (entity_->run_next(taken->source, taken->arrival.entity, begin)) return true;
  }
  trace().overwritten(inbox_->overwritten());
  return false;
}

void EntityCallback::dispose() noexcept {
  tell_lost();
  entity_->disconnect();
  inbox_->set_trace(nullptr);
  trace().overwritten(inbox_->overwritten());
}

}  // namespace cie_rclcpp
