#include "instance_builder.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace cie::analysis {

void InstanceBuilder::follow_grid(LiveInstance& live, bool follows) {
  auto& facts = *live.callback_facts;
  if (facts.grid.is_refuted || !TimerGrid::is_possible(facts.period_ns)) return;
  auto& callback = callbacks_[live.callback];
  auto& grid = callback.grid;
  const auto now = live.start.time;
  const auto before = std::exchange(callback.last_start, now);
  // Here a loss counts for all of its packet.
  const bool may_lack = before && recording_.user_losses().any_between(live.host, *before, now);
  if (!grid) {
    const Duration period{static_cast<std::int64_t>(facts.period_ns)};
    grid = std::make_unique<TimerGrid>(*facts.first_expiry, period);
    if (before) grid->begin_after(may_lack ? std::nullopt : before);
  } else if (may_lack || !follows) {
    grid->lose();
  }
  TimerGrid::Start start{.time = now, .called_after = std::nullopt, .busy_since = std::nullopt};
  const auto is_at_once = [now, &grid](Timestamp end) { return now - end <= grid->prompt(); };
  if (live.thread) {
    const auto& thread = of_thread(live.thread);
    // Whatever the thread did last, the timer was called afterwards.
    if (thread.has_waited)
      start.called_after = std::max<std::optional<Timestamp>>(thread.last_activity, thread.wakeup);
    start.after = thread.last_activity;
    // Not by what is open: it may have been left by an exception, or its end was lost.
    if (thread.last_activity && is_at_once(*thread.last_activity))
      start.busy_since = thread.busy_since;
  }
  // Its last instance began no later than this one's release.
  const auto& ended = callback.recent;
  if (ended.size() > 0 && is_at_once(ended.newest(0).end.time)) start.busy_since = Timestamp{};
  if (const auto release = grid->on_start(start)) {
    live.expiry = release->expiry;
    live.missed = release->missed.value_or(0);
    live.is_missed_known = release->missed && release->is_missed_its_own;
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
