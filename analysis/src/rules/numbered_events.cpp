#include "numbered_events.hpp"

#include "judgement.hpp"

#include <algorithm>

namespace cie::analysis {

std::optional<Evidence> gap_of(const SequenceFacts& numbers, const char* event,
                               const char* number) {
  if (numbers.first_gap) {
    const auto& gap = *numbers.first_gap;
    return evidence(event, gap.after,
                    note("numbers-jump", {{"field", number},
                                          {"expected", gap.expected},
                                          {"seen", gap.seen},
                                          {"missing", numbers.missing}}));
  }
  if (numbers.missing != 0) {
    return evidence(event, numbers.last_at,
                    note("numbers-missing", {{"missing", numbers.missing}, {"field", number}}));
  }
  if (numbers.repeated != 0) {
    return evidence(event, numbers.last_at,
                    note("numbers-repeat", {{"field", number}, {"repeated", numbers.repeated}}));
  }
  return std::nullopt;
}

std::uint64_t first_number(const SequenceFacts& numbers, const std::optional<EventRef>& registered,
                           std::uint64_t promised) {
  if (!registered) return numbers.first.value_or(promised);
  return std::min(numbers.first.value_or(promised), promised);
}

std::uint64_t open_instances(const CallbackFacts& facts) {
  const auto unpaired = facts.ends_before_first + facts.second_ends + facts.ends_without_start;
  const auto paired = facts.ended.count - std::min(facts.ended.count, unpaired);
  return facts.starts.count - std::min(facts.starts.count, paired);
}

std::uint64_t unended(const CallbackTotals& totals) {
  return totals.started - std::min(totals.started, totals.ended);
}

bool tells_lost_end(const CallbackFacts& facts, const CallbackTotals& totals) {
  const auto first = first_number(facts.starts, facts.registered, facts.first_next_seq);
  return open_instances(facts) > unended(totals) ||
         (first == 0 && facts.ended.count < totals.ended);
}

std::optional<Evidence> lost_start(const CallbackFacts& facts) {
  if (facts.first_end_without_start) {
    const auto& [seq, where] = *facts.first_end_without_start;
    return evidence("callback_end", where, note("end-without-start", {{"seq", seq}}));
  }
  // A number promised to the next start cannot end before that start.
  if (facts.registered && !facts.starts.first && facts.ended.last &&
      *facts.ended.last >= facts.first_next_seq) {
    return evidence("callback_end", facts.ended.last_at,
                    note("end-without-start", {{"seq", *facts.ended.last}}));
  }
  return std::nullopt;
}

}  // namespace cie::analysis
