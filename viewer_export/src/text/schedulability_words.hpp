// What is said of schedulability, on the screen and in the whole text.
#pragma once

#include <cie/analysis/schedulability.hpp>

#include "words/text_layout.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::viewer_export {

using DurationFormat = std::string (*)(std::int64_t ns);

// "2 of 28 callbacks have a bound; 3 of 19 deadlines missed, 2 not guaranteed, 14 undecided".
std::string outcome(const analysis::SchedulabilityReport& report);
Look outcome_look(const analysis::SchedulabilityReport& report);
// Why no deadline is decided; empty if one is.
std::string undecided(const analysis::SchedulabilityReport& report);

bool has_fixed_priority(const analysis::CallbackSchedulability& callback);
// "FIFO 80".
std::string policy_of(const analysis::CallbackSchedulability& callback);
// "=" marks what the spec or the callback declares, and nothing else.
std::string parameter(const std::optional<analysis::TaskParameter>& value, DurationFormat format,
                      std::int64_t measured_besides = 0);
// ">" where an instance whose release is not known took longer than those of which it is, or may
// have.
std::string longest_observed(const analysis::CallbackSchedulability& callback,
                             DurationFormat format);
std::string time_or_dash(const std::optional<std::int64_t>& ns, DurationFormat format);
// Whether its deadline is met: "MISSED", "NO", "?", "yes"; "ABOVE R" of one that is flagged.
TextCell standing(const analysis::CallbackSchedulability& callback);

// Those of which there is more to tell than why there is no bound, the worst first.
std::vector<const analysis::CallbackSchedulability*> worst_first(
    const analysis::SchedulabilityReport& report);

// Of one that is above its bound: by how much, then what accounts for it.
std::vector<std::string> why_above(const analysis::CallbackSchedulability& callback);

// Which reasons are told together.
enum class Sameness : std::uint8_t {
  equal,
  alike  // those that differ in numbers and ids, too
};

// What callbacks have in common.
struct CommonReason {
  std::vector<const analysis::CallbackSchedulability*> callbacks;  // never empty, the worst first

  const std::string& reason() const { return callbacks.front()->reason; }
  bool is_equal() const;  // of all callbacks
};
// Why there is no bound, and why one decides no deadline: each reason once, the most frequent first.
std::vector<CommonReason> without_bound(const analysis::SchedulabilityReport& report,
                                        Sameness sameness);
std::vector<CommonReason> undecided_by_bound(const analysis::SchedulabilityReport& report,
                                             Sameness sameness);

// "measured in the window 7..9 ns (2 ns) alone"; empty without one.
std::string measured_window(const analysis::Report& report);

// What CPUs are demanded and reserved, a sentence each, the most demanded first: above all of it,
// then unknown.
std::vector<std::string> processors(const analysis::SchedulabilityReport& report);

}  // namespace cie::viewer_export
