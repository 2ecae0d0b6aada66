// What the rules about times of instances say of one, and of its release.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "judgement.hpp"
#include "model/facts.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

template <typename Value>
Evidence start_of(const Extreme<Value>& extreme, const std::string& note) {
  return evidence("callback_start", extreme.start, "seq " + std::to_string(extreme.seq) + note);
}

// Said of instances that stand in the trace where other streams do not.
inline constexpr const char* kOutside = "; outside of what all streams cover, so not counted";

// The instance that an extreme was taken from: its start and its end.
std::vector<Evidence> shown_by(const Extreme<Duration>& extreme, const std::string& what);
// What violates a rule only by instances that may be another callback's.
void doubt_others(const CallbackFacts& callback, const std::string& finding, Judgement& judgement);
// Whether a timer was reset nobody tells.
std::optional<Evidence> calculated_releases(const CallbackFacts& callback);
// " (calculated, to 5 ns)" of releases that are; else empty.
std::string error_of(const CallbackFacts& callback);

}  // namespace cie::analysis
