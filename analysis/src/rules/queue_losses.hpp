// What was lost of a callback's samples.
#pragma once

#include "model/facts.hpp"

#include <cstdint>

namespace cie::analysis {

struct RuleContext;

struct QueueLosses {
  std::uint64_t lost = 0;         // before its queue
  std::uint64_t overwritten = 0;  // in it
  bool are_totals_seen = false;   // else at least that many
  // Were overwritten, though the totals are seen: cie_rclcpp counts by what the middleware announces, and
  // lacks some.
  bool is_overwritten_at_least = false;
};

// Of a callback that was registered.
QueueLosses queue_losses(const RuleContext& context, const CallbackFacts& callback);

}  // namespace cie::analysis
