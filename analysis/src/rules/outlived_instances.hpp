// Instances that never ended while their process went on, where no total tells that they did not.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/verdict.hpp>

#include "rule_context.hpp"

#include <optional>

namespace cie::analysis {

// How long an open instance of an interrupted process was open for certain, or why that is unknown.
struct OutlivedInstance {
  EventRef last{};                  // its thread lived until then
  Note sign{};                      // what shows it
  Timestamp until{};                // no later than `last`, nor than what the record covers
  std::optional<Evidence> doubt{};  // why its end may be missing all the same
};

// Empty: its process has totals or told nothing since, its thread told its own end, or the events come from a system
// that runs, and its process has told of itself in another session since, whose events may come earlier.
std::optional<OutlivedInstance> outlived(const RuleContext& context, const CallbackFacts& callback,
                                         const OpenInstance& open);

}  // namespace cie::analysis
