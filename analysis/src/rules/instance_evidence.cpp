#include "instance_evidence.hpp"

namespace cie::analysis {

void fail_with(const Extreme<Duration>& extreme, const std::string& what, Judgement& judgement) {
  const auto released =
      extreme.release ? ", released at " + std::to_string(extreme.release->ns) : std::string();
  judgement.fail(start_of(extreme, " starts" + released));
  judgement.fail(evidence(extreme.end ? "callback_end" : "callback_start",
                          extreme.end.value_or(extreme.start), what));
}

void doubt_others(const CallbackFacts& callback, const std::string& finding, Judgement& judgement) {
  judgement.doubt(
      evidence("callback_start", callback.own->others_since,
               "from here on an instance " + std::string(kPerhapsAnothers) + "; " + finding));
}

std::optional<Evidence> calculated_releases(const CallbackFacts& callback) {
  if (callback.are_releases_certain()) return std::nullopt;
  return evidence("callback_start", callback.starts.last_at,
                  "releases are calculated from when the timer was made; it may have been reset");
}

std::string error_of(const CallbackFacts& callback) {
  if (!callback.has_grid_releases()) return {};
  const auto spread = callback.release_spread();
  const auto earlier = spread.ns > 0 ? "; released up to " + nanoseconds(spread) +
                                           " earlier yet if the thread was preempted as rcl made "
                                           "the timer"
                                     : std::string();
  return " (calculated, to " + nanoseconds(callback.release_error()) + earlier + ')';
}

}  // namespace cie::analysis
