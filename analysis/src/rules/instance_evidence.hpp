// What the rules about times of instances say of one, and of its release.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/analysis/verdict.hpp>

#include "judgement.hpp"
#include "model/facts.hpp"

#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis {

// Its number becomes the first argument of `what`, "seq".
template <typename Value>
Evidence start_of(const Extreme<Value>& extreme, Note what) {
  what.arguments.insert(what.arguments.begin(), {"seq", extreme.seq});
  return evidence("callback_start", extreme.start, std::move(what));
}

// Of instances that stand in the trace where other streams do not: "…; outside of what all streams cover, so not
// counted".
Note not_counted(Note finding);

// The instance that an extreme was taken from: its start and its end.
std::vector<Evidence> shown_by(const Extreme<Duration>& extreme, Note what);
// What violates a rule only by instances that may be another callback's.
void doubt_others(const CallbackFacts& callback, Note finding, Judgement& judgement);
// Whether a timer was reset nobody tells.
std::optional<Evidence> calculated_releases(const CallbackFacts& callback);
// " (calculated, to 5 ns)" of releases that are.
std::optional<Note> error_of(const CallbackFacts& callback);

}  // namespace cie::analysis
