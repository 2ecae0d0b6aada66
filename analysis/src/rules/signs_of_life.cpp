#include "signs_of_life.hpp"

#include <cie/analysis/note.hpp>

#include "judgement.hpp"
#include "thread_questions.hpp"
#include "thread_succession.hpp"

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

namespace cie::analysis {

const std::vector<SignsOfLife::Sign>& SignsOfLife::of_callbacks(ThreadIndex thread) {
  const auto [known, is_new] = of_callbacks_.try_emplace(thread);
  auto& signs = known->second;
  if (!is_new) return signs;
  for (const auto* pair : thread_of(context_.model, thread).ran) {
    signs.push_back({.at = pair->first_start, .of = pair, .is_first = true});
    signs.push_back({.at = pair->last_activity, .of = pair});
  }
  std::ranges::stable_sort(signs, {}, [](const Sign& sign) { return sign.at.time; });
  return signs;
}

Evidence SignsOfLife::evidence_of(const Sign& sign, const std::string& name) const {
  const auto& callback = context_.model.callbacks[at(sign.of->callback)];
  const auto is_start_of = [&sign](const OpenInstance& open) {
    return open.thread == sign.of->thread && open.start.time == sign.at.time;
  };
  const bool is_start =
      sign.is_first ? sign.of->starts > 0 : std::ranges::any_of(callback.open, is_start_of);
  return evidence(is_start ? "callback_start" : "callback_end", sign.at,
                  note("thread-still-runs-callback",
                       {{"thread", name}, {"callback", NamedCallback{callback.logical_id}}}));
}

std::optional<Evidence> SignsOfLife::since(ThreadIndex index, Timestamp time) {
  const auto& thread = thread_of(context_.model, index);
  const auto name = thread_name(thread);
  const auto& signs = of_callbacks(index);
  const auto sign =
      std::ranges::lower_bound(signs, time, {}, [](const Sign& of) { return of.at.time; });
  std::optional<Evidence> first;
  if (sign != signs.end()) first = evidence_of(*sign, name);
  const auto consider = [&](std::string_view event, const EventRef& at, const char* code) {
    if (at.time >= time && (!first || at.time < first->time))
      first = evidence(std::string(event), at, note(code, {{"thread", name}}));
  };
  if (is_fini_own(thread)) consider("thread_fini", *thread.fini, "thread-ends-only-here");
  if (thread.kernel_exit && context_.lives.of(index).has_exited)
    consider(thread.kernel_exit_event, *thread.kernel_exit, "thread-exits-only-here");
  if (const auto* run = lived_on(context_, index, time))
    consider("sched_switch", *run, "thread-still-runs");
  for (const auto* seen : {&thread.announced, &thread.first_seen, &thread.last_seen})
    if (*seen) consider({}, **seen, "thread-still-there");
  return first;
}

Evidence SignsOfLife::first(ThreadIndex index) const {
  const auto& thread = thread_of(context_.model, index);
  const auto begin = context_.lives.of(index).begin;
  auto there = note("thread-there-already", {{"thread", thread_name(thread)}});
  if (thread.announced && thread.announced->time == begin)
    return evidence("thread_init", *thread.announced, std::move(there));
  const bool has_event = thread.first_seen && thread.first_seen->time == begin;
  return without_event(has_event ? *thread.first_seen : moment(begin, thread.tid),
                       std::move(there));
}

}  // namespace cie::analysis
