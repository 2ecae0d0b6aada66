#include "save_trigger.hpp"

#include <cie/analysis/rule_pages.hpp>

#include <utility>

#include <fmt/format.h>

namespace cie::live {
namespace {

// Subjects may come and go for ever.
constexpr std::size_t kMostTold = 10'000;

double in_ms(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

}  // namespace

void SaveTrigger::see(const Snapshot& snapshot) {
  see_violations(snapshot);
  see_deadlines(snapshot);
}

void SaveTrigger::see_violations(const Snapshot& snapshot) {
  for (const auto& change : snapshot.changes) {
    // Of deadlines see_deadlines() tells each miss, not only the first.
    if (change.to != analysis::Verdict::fail || change.rule == analysis::kDeadlineRule) continue;
    if (told_.size() >= kMostTold) continue;
    if (!told_.insert(verdict_key(change.rule, change.about, change.subject)).second) continue;
    add(change.rule, fmt::format("{} {}: {}", change.rule, change.name, change.subject));
  }
}

void SaveTrigger::see_deadlines(const Snapshot& snapshot) {
  for (const auto& callback : snapshot.callbacks) {
    if (!callback.deadline_ns || !callback.total_late) continue;
    // Of those that it declares the recorder sees what has ended.
    const auto late = callback.is_deadline_of_spec ? *callback.total_late : callback.open_late;
    if (late <= std::exchange(late_[callback.index], late)) continue;
    const auto times = callback.open_late > 0
                           ? fmt::format("by an instance that has not ended for {:.3f} ms",
                                         in_ms(*callback.open_ns))
                           : fmt::format("{} times so far", late);
    add("a deadline", fmt::format("{} missed its deadline of {:.3f} ms, {}", callback.logical_id,
                                  in_ms(*callback.deadline_ns), times));
  }
}

void SaveTrigger::add(const std::string& kind, std::string reason) {
  if (taken_ >= limits_.most) {
    ++left_out_;
  } else if (reason_.empty()) {
    reason_ = std::move(reason);
  } else {
    others_.insert(kind);
  }
}

std::optional<std::string> SaveTrigger::take(Clock::time_point now, bool is_end) {
  const bool is_early = last_ && now - *last_ < limits_.least_interval && !is_end;
  if (reason_.empty() || is_early) return std::nullopt;
  last_ = now;
  ++taken_;
  auto reason = std::exchange(reason_, {});
  for (const auto& kind : std::exchange(others_, {}))
    reason += "; also " + kind;
  return reason;
}

}  // namespace cie::live
