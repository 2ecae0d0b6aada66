#include "lifetime_parameters.hpp"

#include "callback_doubts.hpp"
#include "model/callback_questions.hpp"
#include "parameter_words.hpp"
#include "rule_context.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// The last of a callback's threads that has a read-back of what was applied.
std::optional<ThreadIndex> configured_thread(const Model& model, const CallbackFacts& callback,
                                             const std::vector<ThreadIndex>& threads) {
  std::optional<ThreadIndex> found;
  for (const auto index : threads) {
    if (last_applied(model, model.threads[at(index)], callback) != nullptr) found = index;
  }
  return found;
}

// What a lifetime's threads were applied last, each different one once.
using Parameters = std::vector<const ReadBack*>;

bool holds(const Parameters& all, const ReadBack& one) {
  return std::ranges::any_of(all, [&one](const auto* of) { return is_same_parameters(*of, one); });
}

void add_applied(const RuleContext& context, ThreadIndex index, const ReadBack* applied,
                 Parameters& all, Judgement& judgement) {
  if (context.proof.may_hide_read_back(index, applied, nullptr))
    judgement.overrule(context.proof.loss(index));
  judgement.overrule(doubt_of_first_audit(context, index));
  if (applied != nullptr && !holds(all, *applied)) all.push_back(applied);
}

// Null: something was applied to each.
const CallbackOnThread* first_unread(const Model& model,
                                     const std::vector<const CallbackOnThread*>& pairs) {
  const auto found = std::ranges::find_if(pairs, [&model](const auto* pair) {
    return last_applied(model, model.threads[at(pair->thread)]) == nullptr;
  });
  return found == pairs.end() ? nullptr : *found;
}

// Of threads that are no callback's own, as of a pool: of all that ran it, for which one does is chance.
Parameters applied_to_shared(const RuleContext& context, CallbackIndex index,
                             Judgement& judgement) {
  Parameters all;
  const auto& model = context.model;
  const auto pairs = on_shared_threads(model, model.callbacks[at(index)]);
  for (const auto* pair : pairs) {
    add_applied(context, pair->thread, last_applied(model, model.threads[at(pair->thread)]), all,
                judgement);
  }
  if (!pairs.empty()) judgement.overrule(context.proof.lost_runs(index));
  const auto* unread = first_unread(model, pairs);
  if (!all.empty() && unread != nullptr) {
    judgement.doubt(evidence("callback_start", unread->first_start,
                             "it ran on " + thread_name(model.threads[at(unread->thread)]) +
                                 ", of which nothing tells what was applied to it"));
  }
  return all;
}

// Why nothing was applied to the callback's threads as far as is known.
void doubt_threads(const RuleContext& context, const CallbackFacts& callback,
                   const std::vector<ThreadIndex>& own, Judgement& judgement) {
  const auto& proof = context.proof;
  for (const auto thread : own)
    judgement.overrule(proof.loss(thread));
  bool is_thread_known = !own.empty() || !callback.ran_on.empty();
  for (const auto* pair : callback.ran_on) {  // perhaps its own, announced unseen
    if (context.model.threads[at(pair->thread)].announced) continue;
    is_thread_known = false;
    judgement.doubt(proof.loss(pair->thread));
  }
  if (!is_thread_known) judgement.doubt(proof.unseen_threads(callback.process));
}

// Of its own thread or, without one, of those that ran it.
Parameters applied_to(const RuleContext& context, CallbackIndex index, Judgement& judgement) {
  const auto& model = context.model;
  const auto& callback = model.callbacks[at(index)];
  const auto own = context.isolated.of(callback);
  Parameters all;
  if (const auto thread = configured_thread(model, callback, own)) {
    add_applied(context, *thread, last_applied(model, model.threads[at(*thread)], callback), all,
                judgement);
    return all;
  }
  doubt_threads(context, callback, own, judgement);
  return own.empty() ? applied_to_shared(context, index, judgement) : all;
}

// Both are of somewhere; of several threads with different parameters, chance decides which run it.
void compare_applied(const Parameters& was, const Parameters& is, Judgement& judgement) {
  const auto count_common = [](const Parameters& some, const Parameters& others) {
    return std::ranges::count_if(some, [&](const auto* one) { return holds(others, *one); });
  };
  const auto common = count_common(is, was);
  if (common == std::ssize(is) && common == std::ssize(was)) return;
  const auto tell = [&](const char* when, const ReadBack& applied, const char* but) {
    auto told = evidence("thread_sched", applied.at, when + describe(applied) + but);
    return common == 0 ? judgement.fail(std::move(told)) : judgement.doubt(std::move(told));
  };
  constexpr const char* kNotInBoth =
      "; it also ran on threads with the parameters of the other lifetime: which of its threads "
      "runs it is chance";
  for (const auto* one : was)
    if (!holds(is, *one)) tell("was: ", *one, common == 0 ? "" : kNotInBoth);
  for (const auto* one : is)
    if (!holds(was, *one)) tell("is: ", *one, common == 0 ? "" : kNotInBoth);
}

}  // namespace

bool has_never_run(const RuleContext& context, const CallbackFacts& callback) {
  const auto& model = context.model;
  const auto own = context.isolated.of(callback);
  return callback.ran_on.empty() && callback.fini && known_instances(model, callback) == 0 &&
         context.proof.is_complete(callback.process) &&
         std::ranges::none_of(own, [&model](ThreadIndex thread) {
           return model.threads[at(thread)].read_backs.count != 0;
         });
}

void compare_parameters(const RuleContext& context, CallbackIndex index_before,
                        CallbackIndex index_after, Judgement& judgement) {
  const auto& model = context.model;
  const auto& before = model.callbacks[at(index_before)];
  const auto& after = model.callbacks[at(index_after)];
  const auto was = applied_to(context, index_before, judgement);
  const auto is = applied_to(context, index_after, judgement);
  if (was.empty() != is.empty() && !has_never_run(context, was.empty() ? before : after)) {
    judgement.doubt(registered_as(is.empty() ? after : before,
                                  "what its thread ran as in this lifetime is unknown"));
  }
  const bool have_run = !before.ran_on.empty() && !after.ran_on.empty();
  if (was.empty() && is.empty() && have_run) {
    if (is_ros2_only(model.processes[at(after.process)])) {
      judgement.doubt(registered_as(after, "ROS 2's events do not tell what its threads ran as"));
    } else {
      judgement.remark(registered_as(after,
                                     "only its kind, source, period and deadline were compared: "
                                     "nothing tells what its threads ran as"));
    }
  }
  if (!was.empty() && !is.empty()) compare_applied(was, is, judgement);
}

}  // namespace cie::analysis
