#include "instance_evidence.hpp"

namespace cie::analysis {
namespace {

// ", released at 8 at the latest"; empty where the start is all that is known of it.
std::string released(const Extreme<Duration>& extreme) {
  if (!extreme.release || extreme.release_source == ReleaseSource::start) return {};
  auto at = ", released at " + std::to_string((*extreme.release).ns);
  switch (extreme.release_source) {
    case ReleaseSource::wakeup:
      return at + " at the latest";
    case ReleaseSource::source_timestamp:
      return at + " at the earliest";
    default:
      return at;
  }
}

}  // namespace

std::vector<Evidence> shown_by(const Extreme<Duration>& extreme, const std::string& what) {
  return {start_of(extreme, " starts" + released(extreme)),
          evidence(extreme.end ? "callback_end" : "callback_start",
                   extreme.end.value_or(extreme.start), what)};
}

void doubt_others(const CallbackFacts& callback, const std::string& finding, Judgement& judgement) {
  judgement.unseen(
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
