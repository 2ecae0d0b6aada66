#include "lifetime_parameters.hpp"

#include <cie/analysis/note.hpp>

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

using Parameters = std::vector<const ReadBack*>;

// What a lifetime's threads were applied last, each different one once, unless others are hidden.
struct Applied {
  Parameters parameters{};
  std::vector<Conjunction> others{};
};

bool holds(const Parameters& all, const ReadBack& one) {
  return std::ranges::any_of(all, [&one](const auto* of) { return is_same_parameters(*of, one); });
}

// Null: nothing was.
void add_applied(const RuleContext& context, ThreadIndex index, const ReadBack* applied,
                 Applied& all) {
  std::ranges::move(applied != nullptr ? context.known.other_parameters(index, *applied)
                                       : context.known.read_backs(index),
                    std::back_inserter(all.others));
  if (applied != nullptr && !holds(all.parameters, *applied)) all.parameters.push_back(applied);
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
Applied applied_to_shared(const RuleContext& context, CallbackIndex index, Judgement& judgement) {
  Applied all;
  const auto& model = context.model;
  const auto pairs = on_shared_threads(model, model.callbacks[at(index)]);
  for (const auto* pair : pairs)
    add_applied(context, pair->thread, last_applied(model, model.threads[at(pair->thread)]), all);
  if (!pairs.empty()) all.others.push_back(context.known.lost_run(index));
  const auto* unread = first_unread(model, pairs);
  if (!all.parameters.empty() && unread != nullptr) {
    judgement.unseen(evidence("callback_start", unread->first_start,
                              note("ran-where-applied-unknown",
                                   {{"thread", thread_name(model.threads[at(unread->thread)])}})));
  }
  return all;
}

// Of its own thread or, without one, of those that ran it.
Applied applied_to(const RuleContext& context, CallbackIndex index, Judgement& judgement) {
  const auto& model = context.model;
  const auto& callback = model.callbacks[at(index)];
  const auto own = context.isolated.of(callback);
  Applied all;
  if (const auto thread = configured_thread(model, callback, own)) {
    add_applied(context, *thread, last_applied(model, model.threads[at(*thread)], callback), all);
    return all;
  }
  for (const auto thread : own)
    add_applied(context, thread, nullptr, all);
  const auto is_announced = [&model](const CallbackOnThread* pair) {
    return model.threads[at(pair->thread)].announced.has_value();
  };
  const bool has_run = !own.empty() || !callback.ran_on.empty();
  const bool may_be_unseen = !has_run || !std::ranges::all_of(callback.ran_on, is_announced);
  if (may_be_unseen && !is_ros2_only(model.processes[at(callback.process)])) {
    judgement.needs({hidden(EventKind::announcement, context.known.scope_of(callback.process))});
  }
  return own.empty() ? applied_to_shared(context, index, judgement) : all;
}

// Both are of somewhere; of several threads with different parameters, chance decides which run it.
void compare_applied(const Parameters& was, const Parameters& is,
                     const std::vector<Conjunction>& others, const std::vector<Evidence>& beside,
                     Judgement& judgement) {
  const auto count_common = [](const Parameters& some, const Parameters& others_of) {
    return std::ranges::count_if(some, [&](const auto* one) { return holds(others_of, *one); });
  };
  const auto common = count_common(is, was);
  if (common == std::ssize(is) && common == std::ssize(was)) return;
  const auto chance = common == 0 ? Note{} : note("also-ran-as-in-other-lifetime");
  std::vector<Evidence> shown;
  const auto tell = [&](const char* code, const Parameters& some, const Parameters& than) {
    for (const auto* one : some) {
      if (holds(than, *one)) continue;
      shown.push_back(evidence("thread_sched", one->at,
                               note(code, {{"parameters", describe(*one)}, {"chance", chance}})));
    }
  };
  tell("lifetime-ran-as", was, is);
  tell("lifetime-runs-as", is, was);
  if (common == 0) {
    judgement.violation_unless(beside, std::move(shown), others);
  } else {
    judgement.unseen(shown);
  }
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
                        CallbackIndex index_after, const std::vector<Evidence>& beside,
                        Judgement& judgement) {
  const auto& model = context.model;
  const auto& before = model.callbacks[at(index_before)];
  const auto& after = model.callbacks[at(index_after)];
  const auto [was, others_before] = applied_to(context, index_before, judgement);
  const auto [is, others_after] = applied_to(context, index_after, judgement);
  auto others = others_before;
  others.insert(others.end(), others_after.begin(), others_after.end());
  judgement.needs_none(others);
  if (was.empty() != is.empty() && !has_never_run(context, was.empty() ? before : after)) {
    judgement.unseen(
        registered_as(is.empty() ? after : before, note("parameters-in-lifetime-unknown")));
  }
  const bool have_run = !before.ran_on.empty() && !after.ran_on.empty();
  if (was.empty() && is.empty() && have_run) {
    if (is_ros2_only(model.processes[at(after.process)])) {
      judgement.unseen(registered_as(after, note("ros2-tells-no-parameters")));
    } else {
      judgement.remark(registered_as(after, note("parameters-not-compared")));
    }
  }
  if (!was.empty() && !is.empty()) compare_applied(was, is, others, beside, judgement);
}

}  // namespace cie::analysis
