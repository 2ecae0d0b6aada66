#include "mapping_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "callback_doubts.hpp"
#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "signs_of_life.hpp"
#include "thread_questions.hpp"
#include "thread_succession.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Pairs of a callback and a thread by first start; content decides ties.
std::vector<const CallbackOnThread*> in_order(const Model& model,
                                              std::span<const CallbackOnThread* const> unordered) {
  std::vector pairs(unordered.begin(), unordered.end());
  std::ranges::stable_sort(pairs, {}, [&model](const CallbackOnThread* pair) {
    return std::tuple(pair->first_start.time, thread_of(model, pair->thread).tid,
                      to_number(model.callbacks[at(pair->callback)].id));
  });
  return pairs;
}

Evidence started_here(const Model& model, const CallbackOnThread& pair) {
  const NamedCallback callback{model.callbacks[at(pair.callback)].logical_id};
  if (pair.starts == 0) {
    const auto& begun = pair.first_begun_elsewhere;
    return evidence(
        "callback_end", pair.first_start,
        note("ended-here", {{"callback", callback},
                            {"seq", pair.first_seq},
                            {"start", begun ? note("started-on-thread", {{"tid", *begun->tid}})
                                            : note("its-start-unseen")}}));
  }
  return evidence("callback_start", pair.first_start,
                  note("started-here",
                       {{"callback", callback}, {"seq", pair.first_seq}, {"times", pair.starts}}));
}

// It is two threads of one tid; three where the first callback ran before the next one's begin and behind it; one if
// that began inside an instance of the first.
std::vector<Conjunction> several_threads(const RuleContext& context, const CallbackOnThread& first,
                                         const CallbackOnThread& next) {
  const auto& known = context.known;
  const auto& nesting = thread_of(context.model, next.thread).nesting;
  if (nesting && nesting->outer == first.callback && nesting->inner == next.callback) return {};
  const auto begin = next.first_start.time;
  const auto last = first.last_activity.time;
  if (begin > last) return known.replaced(next.thread, last, begin);
  auto before = known.replaced(next.thread, first.first_start.time, begin);
  const auto behind = known.replaced(next.thread, begin, last);
  if (before.empty() || behind.empty()) return {};
  before.front().insert(before.front().end(), behind.front().begin(), behind.front().end());
  return before;
}

// Two callbacks that ran on the thread, unless they are one.
void claim_two_callbacks(const RuleContext& context, const CallbackOnThread& first,
                         const CallbackOnThread& next, Judgement& judgement) {
  std::vector excuses{context.known.another_owner(first), context.known.another_owner(next)};
  for (auto& excuse : several_threads(context, first, next))
    excuses.push_back(std::move(excuse));
  judgement.violation(
      [&] {
        return std::vector{started_here(context.model, first), started_here(context.model, next)};
      },
      excuses);
}

std::vector<SubjectVerdict> judge_one_callback(const RuleContext& context) {
  const auto& known = context.known;
  auto verdicts = judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        if (thread.ran.empty() && !is_isolated(thread)) return;
        const CallbackOnThread* former = nullptr;  // that did something last
        for (const auto* pair : in_order(context.model, thread.ran)) {
          judgement.checked(pair->starts);
          if (former != nullptr && !judgement.is_full())
            claim_two_callbacks(context, *former, *pair, judgement);
          if (former == nullptr || pair->last_activity.time > former->last_activity.time)
            former = pair;
        }
        if (const auto lost = context.run_losses.on(index)) judgement.needs(known.lost_run(*lost));
        need_no_others(context, index, judgement);
      });
  note_missing_vtid(context, verdicts);
  note_runs_lost_whole(context, verdicts);
  return verdicts;
}

// Compares the threads that a callback ran on, two at a time.
class ThreadsOfCallback {
 public:
  ThreadsOfCallback(const RuleContext& context, SignsOfLife& signs, const CallbackFacts& callback,
                    Judgement& judgement)
      : context_(context),
        signs_(signs),
        judgement_(judgement),
        pairs_(in_order(context.model, callback.ran_on)) {
    std::erase_if(pairs_, [](const CallbackOnThread* pair) { return !pair->is_certain; });
  }

  void judge() {
    constexpr std::size_t kMost = 64;  // each with each would be quadratic
    if (pairs_.size() > kMost) {
      judge_with_longest();
      return;
    }
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (std::size_t k = i + 1; k < pairs_.size() && !judgement_.is_full(); ++k)
        judge(i, k);
    }
  }

 private:
  const ThreadLife& life(std::size_t place) const {
    return context_.lives.of(pairs_[place]->thread);
  }

  // By begin, each with those before it that lasted longest: of all, of those whose exit was not seen,
  // and of those that are told to have ended. If any of them lived together with it, or may have done,
  // one of these did.
  void judge_with_longest() {
    std::vector<std::size_t> places(pairs_.size());
    std::iota(places.begin(), places.end(), std::size_t{0});
    std::ranges::stable_sort(places, {}, [this](std::size_t place) { return life(place).begin; });
    std::optional<std::size_t> longest;
    std::optional<std::size_t> unended;
    std::optional<std::size_t> told_last;
    const auto lasts_longer = [this](std::size_t place, std::optional<std::size_t> than) {
      return !than || life(place).end > life(*than).end;
    };
    for (const auto place : places) {
      if (judgement_.is_full()) return;
      if (longest) judge(*longest, place);
      if (unended && unended != longest) judge(*unended, place);
      if (told_last && told_last != longest) judge(*told_last, place);
      if (lasts_longer(place, longest)) longest = place;
      if (!life(place).has_ended()) {
        if (lasts_longer(place, unended)) unended = place;
      } else if (!told_last || life(place).ended_by > life(*told_last).ended_by) {
        told_last = place;
      }
    }
  }

  void judge(std::size_t one, std::size_t other) {
    const bool is_in_order = life(one).begin <= life(other).begin;
    const auto& first = *pairs_[is_in_order ? one : other];
    const auto earlier = first.thread;
    const auto later = pairs_[is_in_order ? other : one]->thread;
    switch (succession(context_, earlier, later)) {
      case Succession::together:
        judgement_.violation([&] { return signs_of_both(one, other); },
                             context_.known.replaced(earlier, first.last_activity.time,
                                                     context_.lives.of(later).begin));
        break;
      case Succession::unknown:
        judgement_.needs({hidden(EventKind::thread_exit, context_.known.scope_of(earlier),
                                 context_.lives.of(earlier).end, context_.lives.of(later).begin)});
        break;
      case Succession::successive:
        break;
    }
  }

  // That it ran on both, and what shows that they lived together.
  std::vector<Evidence> signs_of_both(std::size_t one, std::size_t other) {
    const auto& former = *pairs_[std::min(one, other)];
    const auto& latter = *pairs_[std::max(one, other)];
    std::vector<Evidence> signs{started_here(context_.model, former),
                                started_here(context_.model, latter)};
    if (auto sign = signs_.since(former.thread, latter.first_start.time)) {
      signs.push_back(*std::move(sign));
      return signs;
    }
    const auto begin = context_.lives.of(latter.thread).begin;
    signs.push_back(signs_.first(latter.thread));
    if (former.first_start.time >= begin) return signs;
    if (auto sign = signs_.since(former.thread, begin)) signs.push_back(*std::move(sign));
    return signs;
  }

  const RuleContext& context_;
  SignsOfLife& signs_;
  Judgement& judgement_;
  std::vector<const CallbackOnThread*> pairs_;
};

std::vector<SubjectVerdict> judge_one_thread(const RuleContext& context) {
  SignsOfLife signs(context);
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        judgement.checked(callback.starts.count);
        judge_threads_together(context, signs, callback, judgement);
        for (const auto* pair : callback.ran_on) {
          if (callback.ran_on.size() > 1) judgement.needs(context.known.another_owner(*pair));
          judgement.needs(context.known.unseen_run(pair->thread));
        }
        judgement.needs(context.known.lost_run(index));
        if (callback.starts_without_tid != 0) {
          judgement.unseen(
              evidence("vtid", callback.starts.first_at,
                       note("own-starts-without-vtid", {{"starts", callback.starts_without_tid}})));
        }
      });
}

std::vector<SubjectVerdict> judge_unique_id(const RuleContext& context) {
  const auto& model = context.model;
  const auto& names = context.names;
  std::map<std::pair<std::size_t, std::string_view>, std::vector<CallbackIndex>> by_id;
  std::vector<SubjectVerdict> verdicts;
  for (const auto index : context.callbacks) {
    const auto& callback = model.callbacks[at(index)];
    if (context.is_after_window(callback)) continue;
    if (is_identified(callback)) {
      by_id[{at(callback.process), callback.logical_id}].push_back(index);
      continue;
    }
    Judgement judgement(names.callback(index), context.known);
    judgement.unseen(
        without_event(first_sign(model, callback),
                      note("logical-id-unknown", {{"text", why_unidentified(callback)}})));
    conclude(std::move(judgement), verdicts);
  }
  for (auto& [key, indices] : by_id) {
    std::ranges::stable_sort(indices, {}, [&model](CallbackIndex index) {
      return model.callbacks[at(index)].registered->time;
    });
    Judgement judgement(names.callback(indices.front()), context.known);
    judgement.checked(indices.size());
    judgement.needs(context.known.unseen_registration(  // of any id
        model.callbacks[at(indices.front())].process));
    for (std::size_t i = 0; i + 1 < indices.size(); ++i) {
      const auto& earlier = model.callbacks[at(indices[i])];
      const auto& later = model.callbacks[at(indices[i + 1])];
      const auto sign = last_sign(earlier);
      const bool is_alive =
          earlier.fini ? sign.time > later.registered->time : sign.time >= later.registered->time;
      if (is_alive) {
        judgement.violation([&] {
          return std::vector{
              evidence("callback_init", *earlier.registered,
                       note("registered-as-id", {{"id", to_number(earlier.id)}})),
              evidence("callback_init", *later.registered,
                       note("registered-again-as-id", {{"id", to_number(later.id)}})),
              evidence(earlier.fini ? "callback_fini" : "callback_start", sign,
                       note("sign-of-life-of-first"))};
        });
      } else if (!earlier.fini) {
        judgement.unseen(
            evidence("callback_init", *later.registered, note("earlier-of-id-perhaps-lived")));
      }
    }
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

void judge_threads_together(const RuleContext& context, SignsOfLife& signs,
                            const CallbackFacts& callback, Judgement& judgement) {
  ThreadsOfCallback(context, signs, callback, judgement).judge();
}

const Rule kOneCallbackPerThread{
    .id = kOneCallbackPerThreadRule,
    .name = "one-callback-per-thread",
    .meaning =
        "Each thread ran one callback only. Threads are told apart by incarnation, so a reused "
        "tid is another thread.",
    .why_it_matters =
        "Callbacks that share a thread wait for each other whatever their priorities: the urgent "
        "one is as late as the slowest before it.",
    .inconclusive_when =
        "a registration of a callback on the thread was not seen, or one lost instances that may "
        "have been another callback's, when a callback without a thread may have been lost with "
        "all of its instances, or when the thread may have served a client or an action of ROS 2, "
        "whose instances its events do not show, or ran a callback of another executor, which "
        "they do show.",
    .remedy =
        "use the isolated executor (--executor isolated), and give each callback a callback group "
        "of its own.",
    .remedy_rclcpp =
        "give each callback a callback group of its own and run each group on an executor and "
        "thread of its own.",
    .violation = "ran several callbacks",
    .gravity = 3,
    .judge = judge_one_callback,
    .needs = {.instances = true}};

const Rule kOneThreadPerCallback{
    .id = kOneThreadPerCallbackRule,
    .name = "one-thread-per-callback",
    .meaning =
        "Each callback ran on one thread at a time: it never ran on two threads that were alive "
        "together, as their own events or, where its record is whole, the kernel's switches show.",
    .why_it_matters =
        "A callback that wanders between threads has no priority and no CPU of its own: what one "
        "thread was given does not hold on the next.",
    .inconclusive_when =
        "the context vtid is absent, instances were lost, it cannot be told whether the earlier "
        "thread still lived, or a thread may have served what ROS 2's events do not show (M2).",
    .remedy = "use the isolated executor (--executor isolated) in place of a pool of threads.",
    .remedy_rclcpp =
        "give each callback a callback group of its own and run each group on an executor and "
        "thread of its own.",
    .violation = "ran on several threads",
    .gravity = 2,
    .judge = judge_one_thread,
    .needs = {.instances = true}};

const Rule kUniqueLogicalId{
    .id = "M7",
    .name = "unique-logical-id",
    .meaning = "No two callbacks of one process live under the same logical id.",
    .why_it_matters =
        "With equal ids one entry of a spec configures whichever comes first, and the other runs "
        "unconfigured.",
    .inconclusive_when =
        "whether the earlier callback of the id still lived is unknown, for a callback that was "
        "never seen to be registered, and where the process counts callbacks of which no event "
        "was seen.",
    .remedy = "give callbacks explicit names, or periods that differ.",
    .remedy_rclcpp =
        "its callbacks have no names: give timers periods that differ, and what shares a node and "
        "a topic or service nodes of its own.",
    .violation = "had ids that others have",
    .judge = judge_unique_id};

}  // namespace cie::analysis
