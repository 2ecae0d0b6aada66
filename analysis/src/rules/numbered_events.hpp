// What the numbers and the totals of one subject tell of events that were not seen.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <cstdint>
#include <optional>

namespace cie::analysis {

// A number of `event` is missing, or came twice; `number`: its field.
std::optional<Evidence> gap_of(const SequenceFacts& numbers, const char* event, const char* number);
// What a subject's totals count from: the number its first registration promised, or the first one
// seen where the registration is an announcement that came later.
std::uint64_t first_number(const SequenceFacts& numbers, const std::optional<EventRef>& registered,
                           std::uint64_t promised);
// Instances that were seen to start and not to end.
std::uint64_t open_instances(const CallbackFacts& facts);
// Instances that never end are told by started - ended.
std::uint64_t unended(const CallbackTotals& totals);
// More instances are open than never ended. Of one that ended twice the first end may be the lost
// one; it counts.
bool tells_lost_end(const CallbackFacts& facts, const CallbackTotals& totals);
// An end whose start was not seen, although it would be in the record.
std::optional<Evidence> lost_start(const CallbackFacts& facts);

}  // namespace cie::analysis
