#include "entity_callback.hpp"

#include <mutex>
#include <optional>
#include <utility>

namespace cie_rclcpp {

using cie::CallbackKind;
using cie::ReleaseKind;
using cie::scheduling::Callback;
using cie::scheduling::ReadySink;

std::shared_ptr<void> farewell(OnGone on_gone) {
  return {nullptr, [on_gone = std::move(on_gone)](void*) { on_gone(); }};
}

EntityCallback::EntityCallback(std::shared_ptr<cie::scheduling::GroupState> group,
                               cie::trace::CallbackInfo info, std::unique_ptr<Entity> entity,
                               std::shared_ptr<Admission> admission, const OnGone& on_gone)
    : Callback(std::move(group), std::move(info)),
      Admitted(std::move(admission)),
      entity_(std::move(entity)),
      inbox_(std::make_shared<Inbox>(entity_->depth(), entity_->process_depth(),
                                     entity_->is_shared())) {
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

// A message that was sent after the announcement it was taken for is a later one, or its publisher's clock
// is ahead of this machine's. A later one is taken where it took the place of that announcement's in a full
// queue between the two, and where there never was a message: the middleware announces, too, that the last
// writer has gone, and answers that are for another client. Then the message's own announcement waits
// still. Nothing tells whether those behind it are later ones, too, until no announcement is left. Where the
// queue was not full and nothing that waits can be its own, it is the clock.
cie::trace::Callback::Release EntityCallback::release_by(
    const Inbox::Taken& taken, std::int64_t source_timestamp_ns) noexcept {
  std::int64_t release = taken.arrival.monotonic_ns;
  if (source_timestamp_ns > 0) {
    const bool is_later = source_timestamp_ns > taken.arrival.realtime_ns;
    is_shifted_ = is_shifted_ || inbox_->may_be_overwritten(taken) ||
                  (is_later && inbox_->may_wait_for(taken, source_timestamp_ns));
    if (is_shifted_ && is_later) release = -1;
    is_shifted_ = is_shifted_ && inbox_->queued() > 0;
  }
  const bool is_message = entity_->kind() == CallbackKind::subscription;
  return {.kind = ReleaseKind::data,
          .release_ns = release,
          .source_timestamp_realtime_ns = is_message ? source_timestamp_ns : 0};
}

void EntityCallback::tell_lost() noexcept {
  if (!inbox_->take_lost()) return;
  if (const std::uint32_t lost = entity_->take_lost(); lost > 0) trace().sample_lost(lost);
}

bool EntityCallback::run_one() {
  Admission::Entry entry = enter();
  if (!entry) return false;
  struct Running {
    EntityCallback& callback;
    Admission::Entry& entry;
    std::unique_lock<cie::PriorityMutex> taking;
    Inbox::Taken taken{};
    std::optional<Instance> instance{};
  } running{.callback = *this, .entry = entry, .taking = std::unique_lock{taking_}};
  tell_lost();
  const Entity::Begin begin = [&running](std::int64_t source_timestamp_ns, std::uint64_t writer) {
    running.callback.inbox_->found(running.taken, writer);
    const auto release = running.callback.release_by(running.taken, source_timestamp_ns);
    running.taking.unlock();
    running.instance.emplace(running.callback, release);
    running.entry.begin();
  };
  while (const auto taken = inbox_->take()) {
    running.taken = *taken;
    if (entity_->run_next(taken->source, taken->arrival.entity, begin)) return true;
    inbox_->found_nothing(*taken);
    is_shifted_ = is_shifted_ || inbox_->may_be_overwritten(*taken);
  }
  is_shifted_ = false;
  trace().overwritten(inbox_->overwritten());
  return false;
}

void EntityCallback::dispose() noexcept {
  leave_share();
  tell_lost();
  entity_->disconnect();
  inbox_->set_trace(nullptr);
  trace().overwritten(inbox_->overwritten());
}

}  // namespace cie_rclcpp
