#include "queue_losses.hpp"

#include "rule_context.hpp"

#include <algorithm>

namespace cie::analysis {
namespace {

// The recording was attached to its process, so that running totals stand for those of an end that
// was never awaited. Not so if it began here, and its first run_begin was lost.
bool is_attached_to(const RuleContext& context, const CallbackFacts& callback) {
  const auto& process = context.model.processes[at(callback.process)];
  if (process.first_moment != RunMoment::announce) return false;
  if (callback.registered->time < process.run_begin->time) return false;
  const Timestamp start{process.start_ns.value_or(0)};
  return !context.user_losses.between(callback.process, start, callback.registered->time);
}

}  // namespace

QueueLosses queue_losses(const RuleContext& context, const CallbackFacts& callback) {
  const auto& fini = callback.fini;
  const auto least = [&](std::uint64_t running, std::uint64_t CallbackTotals::*total) {
    return fini && callback.are_totals_told ? std::max(running, (*fini).*total) : running;
  };
  const bool has_totals = fini || (callback.releases > 0 && is_attached_to(context, callback));
  const auto overwritten = least(callback.overwritten, &CallbackTotals::overwritten);
  return {.lost = least(callback.lost, &CallbackTotals::lost),
          .overwritten = overwritten,
          .are_totals_seen = callback.are_totals_told && has_totals,
          .is_overwritten_at_least =
              overwritten > 0 && context.of_cie_rclcpp.contains(callback.process)};
}

}  // namespace cie::analysis
