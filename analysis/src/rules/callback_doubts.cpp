#include "callback_doubts.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "rule_context.hpp"

#include <utility>

namespace cie::analysis {

std::optional<Evidence> perhaps_anothers(const CallbackOnThread& pair) {
  if (pair.is_certain) return std::nullopt;
  return evidence(pair.starts != 0 ? "callback_start" : "callback_end", pair.first_start,
                  note("instance-perhaps-anothers", {{"what", perhaps_anothers_note()}}));
}

std::optional<Evidence> perhaps_another_process(const CallbackFacts& callback) {
  if (!callback.is_after_rcl_init) return std::nullopt;
  return without_event(
      *callback.registered,
      note("made-after-another-rcl-init", {{"callback", NamedCallback{callback.logical_id}}}));
}

std::optional<Evidence> perhaps_told_by_own(const Model& model, const Proof& proof,
                                            const ThreadLosses& losses,
                                            const CallbackFacts& callback) {
  if (may_be_told_by_own(model, callback)) {
    return without_event(
        first_sign(model, callback),
        note("only-in-ros2-events", {{"callback", NamedCallback{callback.logical_id}}}));
  }
  if (callback.is_accounted || model.processes[at(callback.process)].is_from_ros2)
    return std::nullopt;
  // Of these one may be it, and a thread that does what rclcpp has for itself one of those.
  if (auto unseen = proof.unseen_callbacks(callback.process)) return unseen;
  if (auto unseen = proof.unseen_threads(callback.process)) return unseen;
  for (const auto* pair : callback.ran_on) {
    if (const auto lost = losses.of_own(pair->thread)) return proof.loss(*lost);
  }
  return std::nullopt;
}

std::optional<Timestamp> registration(const RuleContext& context, const CallbackFacts& callback) {
  const auto& begin = context.model.processes[at(callback.process)].run_begin;
  if (!begin || !callback.registered || callback.may_repeat) return std::nullopt;
  const auto registered = callback.registered->time;
  // It may follow an announcement whose run_begin was lost.
  const bool is_doubtful = registered < begin->time ||
                           context.user_losses.between(callback.process, begin->time, registered);
  return is_doubtful ? std::nullopt : std::optional(registered);
}

Evidence registered_as(const CallbackFacts& callback, Note note) {
  return evidence(callback.is_accounted ? "callback_init" : "", *callback.registered,
                  std::move(note));
}

}  // namespace cie::analysis
