#include "thread_questions.hpp"

#include "judgement.hpp"
#include "rule_context.hpp"

#include <algorithm>

namespace cie::analysis {

std::string thread_name(const ThreadFacts& thread) {
  return "thread " + std::to_string(thread.tid) +
         (thread.name.empty() ? std::string() : " \"" + thread.name + "\"");
}

bool is_fini_own(const ThreadFacts& thread) noexcept {
  return thread.fini && thread.fini->tid.value_or(thread.tid) == thread.tid;
}

std::optional<Evidence> end_after_fini(const ThreadFacts& thread, const CallbackOnThread& pair) {
  if (!thread.fini || pair.last_activity.time <= thread.fini->time) return std::nullopt;
  return evidence("callback_end", pair.last_activity,
                  "ended on thread " + std::to_string(thread.tid) + " after its thread_fini");
}

bool may_be_former(const RuleContext& context, const ThreadFacts& thread) {
  return thread.former_fini && !thread.announced && !context.proof.is_complete(thread.process);
}

bool is_isolated(const ThreadFacts& thread) noexcept {
  return thread.announced && thread.role == ThreadRole::callback;
}

bool is_of_other_role(const ThreadFacts& thread) noexcept {
  return thread.announced && thread.role && thread.role != ThreadRole::callback;
}

bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept {
  if (thread.process != callback.process) return false;
  if (thread.callback) return *thread.callback == callback.id;
  return thread.group && callback.group && *thread.group == *callback.group;
}

const EventRef& first_start_on(const ThreadFacts& thread) {
  const auto first = std::ranges::min_element(
      thread.ran, {}, [](const CallbackOnThread* pair) { return pair->first_start.time; });
  return (*first)->first_start;
}

const ReadBack* last_applied(const Model& model, const ThreadFacts& thread) noexcept {
  if (!thread.applied.empty()) return &thread.applied.back();
  const bool is_attached = model.processes[at(thread.process)].first_moment == RunMoment::announce;
  return is_attached && thread.first_audit ? &*thread.first_audit : nullptr;
}

std::optional<Evidence> doubt_of_first_audit(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (!thread.applied.empty() || !thread.first_audit) return std::nullopt;
  return context.proof.lost_read_back_before(index, thread.first_audit->at.time);
}

}  // namespace cie::analysis
