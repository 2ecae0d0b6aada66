#include "instance_builder.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace cie::analysis {
namespace {

// So long an executor takes at most to find out that something is due already when it begins to wait, as
// far as nobody but its own events tell.
constexpr Duration kLongestLook{100'000};

}  // namespace

// The kernel's events tell a wait from a long look, and from a wait for a CPU.
bool InstanceBuilder::is_busy_since(HostIndex host, ThreadIndex index, Timestamp time,
                                    Timestamp now, Duration prompt) {
  const auto& thread = threads_[index];
  const auto& facts = model_.threads[at(index)];
  const bool has_kernel = recording_.has_kernel(host) && facts.is_known_to_kernel;
  if (const auto* left = left_.find(index); has_kernel && left != nullptr && left->time == time) {
    const auto parts = ThreadTimeline::between(*left, timeline_.mark(host, facts.tid, now));
    if (parts && parts->blocked)
      return *parts->blocked <= kLongestLook && parts->execution <= prompt;
  }
  if (now - time > prompt) return false;
  if (!thread.wakeup || *thread.wakeup - time <= kLongestLook) return true;
  const auto wake = has_kernel ? timeline_.last_wake(host, facts.tid) : ThreadTimeline::Wake{};
  return wake.waking && *wake.waking >= time && *wake.waking - time <= kLongestLook;
}

void InstanceBuilder::follow_grid(PendingInstance& pending) {
  const auto release =
      follow_grid(pending.host, pending.thread, pending.callback, *pending.callback_facts,
                  {.time = pending.start.time, .seq = pending.seq, .stream = pending.stream}, true);
  if (!release) return;
  pending.expiry = release->expiry;
  pending.missed = release->missed.value_or(0);
  pending.is_missed_known = release->missed && release->is_missed_its_own;
  if (!release->is_prompt) pending.proven_by = pending.callback_facts->grid.prompt_starts + 1;
}

std::optional<TimerGrid::Release> InstanceBuilder::follow_grid(
    HostIndex host, const std::optional<ThreadIndex>& on, CallbackIndex index, CallbackFacts& facts,
    const TimerStart& started, bool is_inside) {
  if (facts.grid.is_refuted || !TimerGrid::is_possible(facts.period_ns)) return std::nullopt;
  auto& callback = callbacks_[index];
  auto& grid = callback.grid;
  const auto now = started.time;
  const auto before = std::exchange(callback.last_start, started);
  // Here a loss counts for all of its packet.
  const bool may_lack = before && (recording_.loss_times().any_between(host, before->time, now) ||
                                   started.seq != before->seq + 1);
  if (!grid) {
    const Duration period{static_cast<std::int64_t>(facts.period_ns)};
    grid = std::make_unique<TimerGrid>(*facts.first_expiry, period);
    if (before) grid->begin_after(may_lack ? std::nullopt : std::optional(before->time));
  } else if (may_lack) {
    grid->lose();
  }
  TimerGrid::Start start{.time = now, .called_after = std::nullopt, .busy_since = std::nullopt};
  start.is_inside = is_inside;
  if (on) {
    const auto& thread = of_thread(on);
    // Whatever the thread did last, the timer was called afterwards.
    if (thread.has_waited)
      start.called_after = std::max<std::optional<Timestamp>>(thread.last_activity, thread.wakeup);
    start.after = thread.last_activity;
    const auto& ran = model_.threads[at(*on)].ran;
    if (!ran.empty()) start.served_since = ran.front()->first_start.time;
    // What it found when it woke up it runs now, be it that it had to wait for a CPU.
    if (thread.wakeup && (!thread.last_activity || *thread.last_activity < *thread.wakeup))
      start.busy_since = thread.wakeup;
    // Not by what is open: it may have been left by an exception, or its end was lost. Where it idled
    // nothing was due.
    if (thread.last_activity &&
        is_busy_since(host, *on, *thread.last_activity, now, grid->prompt())) {
      start.busy_since = thread.busy_since;
    }
  }
  const auto is_recorded_since_made = [&] {
    const auto& begin = recording_.window_of(started.stream).begin;
    return begin && *begin <= *facts.first_expiry;
  };
  // Nobody recorded whether it ran before, on some other thread.
  if (!before && !is_recorded_since_made()) start.served_since = Timestamp{};
  // Its last instance began no later than this one's release, and other threads had to wait for its end.
  const auto follows = [&](Timestamp end) {
    if (!on) return now - end <= grid->prompt();
    const auto& last = of_thread(on).last_activity;
    if (!last || *last <= end) return is_busy_since(host, *on, end, now, grid->prompt());
    return now - end <= grid->prompt() && is_busy_since(host, *on, *last, now, grid->prompt());
  };
  const auto& ended = callback.recent;
  if (ended.size() > 0 && follows(ended.newest(0).end.time)) start.busy_since = Timestamp{};
  const auto release = grid->on_start(start);
  facts.grid.prompt_starts = grid->prompt_starts();
  if (grid->is_steady()) measurer_.prove(index);
  if (is_inside) facts.grid.unresolved = grid->unresolved();
  facts.grid.is_steady = grid->is_steady();
  facts.grid.error = grid->error();
  if (grid->is_refuted()) measurer_.forget_releases(index);
  return release;
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
  if (facts.own && unproven.since <= facts.own->others_since.time)
    facts.own->missed -= std::min<std::uint64_t>(facts.own->missed, unproven.missed);
  if (facts.first_missed && facts.first_missed->start.time >= unproven.since &&
      unproven.releases > 0) {
    facts.first_missed.reset();
  }
}

}  // namespace cie::analysis
