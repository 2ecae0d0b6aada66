#include "instance_builder.hpp"

#include <algorithm>
#include <memory>

namespace cie::analysis {

void InstanceBuilder::follow_grid(LiveInstance& live) {
  auto& facts = *live.callback_facts;
  if (facts.grid.is_refuted || !TimerGrid::is_possible(facts.period_ns)) return;
  auto& callback = callbacks_[live.callback];
  auto& grid = callback.grid;
  if (!grid) {
    const Duration period{static_cast<std::int64_t>(facts.period_ns)};
    grid = std::make_unique<TimerGrid>(*facts.first_expiry, period);
    if (callback.started_before) {
      grid->begin_after(callback.losses == losses_ ? callback.started_before : std::nullopt);
    }
    callback.losses = losses_;
  }
  if (callback.losses != losses_) grid->lose();
  callback.losses = losses_;
  const auto now = live.start.time;
  TimerGrid::Start start{.time = now, .called_after = std::nullopt, .busy_since = std::nullopt};
  const auto follows = [now, &grid](Timestamp end) { return now - end <= grid->prompt(); };
  if (live.thread) {
    const auto& thread = of_thread(live.thread);
    // Whatever the thread did last, the timer was called afterwards.
    if (thread.has_waited)
      start.called_after = std::max<std::optional<Timestamp>>(thread.last_activity, thread.wakeup);
    start.after = thread.last_activity;
    const bool is_busy =
        !thread.open.empty() || (thread.last_activity && follows(*thread.last_activity));
    if (is_busy) start.busy_since = thread.busy_since;
  }
  // Its last instance began no later than this one's release.
  const auto& ended = callback.recent;
  if (ended.size() > 0 && follows(ended.newest(0).end.time)) start.busy_since = Timestamp{};
  if (const auto release = grid->on_start(start)) {
    live.expiry = release->expiry;
    live.missed = release->missed.value_or(0);
    live.is_missed_known = release->missed.has_value();
    if (!release->is_prompt) live.proven_by = grid->prompt_starts() + 1;
  }
  facts.grid.prompt_starts = grid->prompt_starts();
  if (grid->is_steady()) measurer_.prove(live.callback);
  facts.grid.unresolved = grid->unresolved();
  facts.grid.is_steady = grid->is_steady();
  facts.grid.error = grid->error();
  if (grid->is_refuted()) measurer_.forget_releases(live.callback);
}

void InstanceBuilder::finish_grid(CallbackIndex index) {
  const auto& grid = callbacks_[index].grid;
  if (!grid) return;
  if (!grid->holds()) {
    measurer_.forget_releases(index);
    return;
  }
  measurer_.leave_bounds(index);
  const auto& unproven = grid->unproven();
  auto& facts = model_.callbacks[at(index)];
  facts.grid.unresolved += unproven.releases;
  facts.missed -= unproven.missed;
  if (facts.first_missed && facts.first_missed->start.time >= unproven.since &&
      unproven.releases > 0) {
    facts.first_missed.reset();
  }
}

}  // namespace cie::analysis
