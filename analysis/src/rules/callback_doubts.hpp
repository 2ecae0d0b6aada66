// What leaves open whose runs a callback's are, and when it was registered.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "model/facts.hpp"

#include <optional>

namespace cie::analysis {

class Proof;
class ThreadLosses;
struct RuleContext;

// Why the runs of the callback on a thread may be another one's; empty: some is its own.
std::optional<Evidence> perhaps_anothers(const CallbackOnThread& pair);
// Why its threads may be those of another process with that pid; empty: they are not.
std::optional<Evidence> perhaps_another_process(const CallbackFacts& callback);
// Why the process's own events may tell of it otherwise, or leave it out; empty: they do not.
std::optional<Evidence> perhaps_told_by_own(const Model& model, const Proof& proof,
                                            const ThreadLosses& losses,
                                            const CallbackFacts& callback);
// When it was registered, where its first callback_init tells that: an announcement repeats what may be
// much older. All of an announcement comes from one thread.
std::optional<Timestamp> registration(const RuleContext& context, const CallbackFacts& callback);
// What tells of its registration. What ROS 2's events say of a callback is no event of its own.
Evidence registered_as(const CallbackFacts& callback, Note note);

}  // namespace cie::analysis
