#include "thread_questions.hpp"

#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "rule_context.hpp"

#include <algorithm>
#include <limits>

namespace cie::analysis {

std::string thread_name(const ThreadFacts& thread) {
  return "thread " + std::to_string(thread.tid) +
         (thread.name.empty() ? std::string() : " \"" + thread.name + "\"");
}

bool is_fini_own(const ThreadFacts& thread) noexcept {
  return thread.fini && thread.fini->tid.value_or(thread.tid) == thread.tid;
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

std::vector<const CallbackOnThread*> on_shared_threads(const Model& model,
                                                       const CallbackFacts& callback) {
  std::vector<const CallbackOnThread*> pairs;
  for (const auto* pair : callback.ran_on) {
    const bool is_shared = is_of_other_role(model.threads[at(pair->thread)]);
    if (is_shared && is_there_for_certain(model, *pair)) pairs.push_back(pair);
  }
  return pairs;
}

namespace {

bool is_owner(const std::optional<CallbackId>& named, const std::optional<GroupId>& group,
              const CallbackFacts& callback) noexcept {
  if (named) return *named == callback.id;
  return group && callback.group && *group == *callback.group;
}

}  // namespace

std::vector<Announcement> announcements_of(const ThreadFacts& thread) {
  std::vector<Announcement> all;
  Announcement last{.at = *thread.announced,
                    .callback = thread.callback,
                    .group = thread.group,
                    .after = Timestamp{std::numeric_limits<std::int64_t>::min()},
                    .fini = thread.fini,
                    .last_change = thread.last_change};
  for (const auto& former : thread.former) {
    all.push_back({.at = former.at,
                   .callback = former.callback,
                   .group = former.group,
                   .after = last.after,
                   .fini = former.fini,
                   .next = former.next.time,
                   .last_change = former.last_change});
    last.at = former.next;
    last.after = former.fini ? former.fini->time : former.next.time;
  }
  all.push_back(last);
  return all;
}

bool is_for(const Announcement& announcement, const CallbackFacts& callback) noexcept {
  return is_owner(announcement.callback, announcement.group, callback);
}

Announcement announcement_of(const ThreadFacts& thread, const CallbackFacts* callback) {
  const auto all = announcements_of(thread);
  const auto found = std::ranges::find_if(all.rbegin(), all.rend(), [&](const auto& one) {
    return callback == nullptr || is_for(one, *callback);
  });
  return found != all.rend() ? *found : all.back();
}

bool is_announced_for(const ThreadFacts& thread, const CallbackFacts& callback) noexcept {
  return is_owner(thread.callback, thread.group, callback);
}

bool is_registered_to(const ThreadFacts& thread, const CallbackFacts& callback) noexcept {
  if (thread.process != callback.process) return false;
  return is_announced_for(thread, callback) ||
         std::ranges::any_of(thread.former, [&callback](const FormerAnnouncement& former) {
           return is_owner(former.callback, former.group, callback);
         });
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

const ReadBack* last_applied(const Model& model, const ThreadFacts& thread,
                             const CallbackFacts& callback) {
  if (thread.former.empty()) return last_applied(model, thread);
  const auto own = announcement_of(thread, &callback);
  const auto found = std::ranges::find_if(thread.applied.rbegin(), thread.applied.rend(),
                                          [&own](const auto& read) { return own.holds(read); });
  return found != thread.applied.rend() ? &*found : nullptr;
}

std::optional<Evidence> unended_change(const Model& model, const ThreadFacts& thread,
                                       const Announcement& of) {
  const ReadBack* last = thread.applied.empty() ? last_applied(model, thread) : nullptr;
  for (const auto& applied : thread.applied)
    if (of.holds(applied)) last = &applied;
  if (of.last_change <= (last != nullptr ? last->change : 0)) return std::nullopt;
  return evidence("thread_sched", last != nullptr ? last->at : of.at,
                  note("change-without-end", {{"change", of.last_change}}));
}

std::optional<Evidence> unended_change(const Model& model, const ThreadFacts& thread) {
  if (!thread.announced) {
    return unended_change(
        model, thread,
        {.at = thread.read_backs.first_at, .after = kEarliest, .last_change = thread.last_change});
  }
  std::optional<Evidence> found;
  for (const auto& announcement : announcements_of(thread))
    if (!found) found = unended_change(model, thread, announcement);
  return found;
}

}  // namespace cie::analysis
