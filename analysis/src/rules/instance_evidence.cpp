#include "instance_evidence.hpp"

#include <string_view>

namespace cie::analysis {
namespace {

std::string_view code_of_release(ReleaseSource source) noexcept {
  switch (source) {
    case ReleaseSource::wakeup:
      return "released-at-latest";
    case ReleaseSource::source_timestamp:
      return "released-at-earliest";
    default:
      return "released-at";
  }
}

// ", released at 8 at the latest"; empty where the start is all that is known of it.
std::optional<Note> released(const Extreme<Duration>& extreme) {
  if (!extreme.release || extreme.release_source == ReleaseSource::start) return std::nullopt;
  return note(code_of_release(extreme.release_source), {{"release", (*extreme.release).ns}});
}

}  // namespace

Note not_counted(Note finding) { return note("not-counted", {{"finding", std::move(finding)}}); }

std::vector<Evidence> shown_by(const Extreme<Duration>& extreme, Note what) {
  return {start_of(extreme, note("instance-starts", {{"released", released(extreme)}})),
          evidence(extreme.end ? "callback_end" : "callback_start",
                   extreme.end.value_or(extreme.start), std::move(what))};
}

void doubt_others(const CallbackFacts& callback, Note finding, Judgement& judgement) {
  judgement.unseen(
      evidence("callback_start", callback.own->others_since,
               note("found-since-perhaps-anothers",
                    {{"why", perhaps_anothers_note()}, {"finding", std::move(finding)}})));
}

std::optional<Evidence> calculated_releases(const CallbackFacts& callback) {
  if (callback.are_releases_certain()) return std::nullopt;
  return evidence("callback_start", callback.starts.last_at, note("timer-perhaps-reset"));
}

std::optional<Note> error_of(const CallbackFacts& callback) {
  if (!callback.has_grid_releases()) return std::nullopt;
  const auto spread = callback.release_spread();
  return note(
      "calculated-to",
      {{"error", callback.release_error()},
       {"earlier", spread.ns > 0 ? note("released-earlier-yet", {{"spread", spread}}) : Note{}}});
}

}  // namespace cie::analysis
