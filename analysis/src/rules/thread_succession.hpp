// How the lives of two threads relate: whether they lived together.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "rule_context.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

enum class Succession : std::uint8_t { together, successive, unknown };

// How two threads' lives relate. `earlier` began no later than `later`.
Succession succession(const RuleContext& context, ThreadIndex earlier, ThreadIndex later);

// The kernel switched it in after its last sign of life, at that time or later. Null: it did not, or what
// was lost meanwhile may be its `thread_fini`, or that somebody else got its tid.
const EventRef* lived_on(const RuleContext& context, ThreadIndex index, Timestamp until);

}  // namespace cie::analysis
