#include "foreign_work_rule.hpp"

#include <cie/analysis/note.hpp>

#include "callback_doubts.hpp"
#include "each_subject.hpp"
#include "judgement.hpp"
#include "scheduled_parameters.hpp"
#include "spec_questions.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// Requires that one came before.
const Announcement& in_force(const std::vector<Announcement>& all, Timestamp time) {
  const auto later =
      std::ranges::find_if(all, [time](const Announcement& one) { return one.at.time > time; });
  return *std::prev(later);
}

// What a callback did on the thread while that was announced for another one.
struct ForeignStart {
  std::uint64_t seq = 0;
  EventRef at{};
  Timestamp since{};  // from then on no other announcement was seen
};

// The thread serves that group: what is made in it while the thread is there is its own, too.
std::optional<GroupId> group_of(const Model& model, const ThreadFacts& thread,
                                const Announcement& announcement) {
  if (announcement.group || !announcement.callback) return announcement.group;
  const auto named = std::ranges::find_if(model.callbacks, [&](const CallbackFacts& callback) {
    return callback.process == thread.process && callback.id == *announcement.callback;
  });
  return named != model.callbacks.end() ? named->group : std::nullopt;
}

bool serves(const Model& model, const ThreadFacts& thread, const Announcement& announcement,
            const CallbackFacts& callback) {
  if (is_for(announcement, callback)) return true;
  return callback.group && group_of(model, thread, announcement) == callback.group;
}

enum class Ownership : std::uint8_t { own, foreign, unknown };

struct Finding {
  Ownership ownership{};
  ForeignStart start{};  // foreign
  EventRef at{};         // unknown
};

// Whether the thread was announced for the callback whenever it ran it. Of a start before the first
// announcement that was seen a later one for another callback says nothing.
Finding ownership_of(const Model& model, const std::vector<Announcement>& all,
                     const ThreadFacts& thread, const CallbackFacts& callback,
                     const CallbackOnThread& pair) {
  const bool is_of_process = thread.process == callback.process;
  const auto& beside = pair.first_beside_other;
  if (beside &&
      !(is_of_process && serves(model, thread, in_force(all, beside->start.time), callback))) {
    return {.ownership = Ownership::foreign,
            .start = {.seq = beside->seq, .at = beside->start, .since = beside->since}};
  }
  const auto is_own_at = [&](Timestamp time) {
    return is_of_process && std::ranges::any_of(all, [&](const Announcement& one) {
             return one.may_hold(time) && serves(model, thread, one, callback);
           });
  };
  const auto& first = pair.first_start;
  if (!is_own_at(first.time)) {
    if (first.time < all.front().at.time) return {.ownership = Ownership::unknown, .at = first};
    return {
        .ownership = Ownership::foreign,
        .start = {.seq = pair.first_seq, .at = first, .since = in_force(all, first.time).at.time}};
  }
  if (is_own_at(pair.last_activity.time)) return {};
  return {.ownership = Ownership::unknown, .at = pair.last_activity};
}

std::vector<Evidence> foreign_start(const CallbackFacts& callback, const CallbackOnThread& pair,
                                    const Announcement& announced, const ForeignStart& start) {
  const bool is_start_seen = pair.starts != 0;
  return {evidence("thread_init", announced.at,
                   announced.callback ? note("announced-for-callback",
                                             {{"callback", to_number(*announced.callback)}})
                                      : note("announced-for-group")),
          evidence(is_start_seen ? "callback_start" : "callback_end", start.at,
                   note(is_start_seen ? "started-foreign-callback" : "ended-foreign-callback",
                        {{"callback", NamedCallback{callback.logical_id}}, {"seq", start.seq}}))};
}

// It was announced for the other callback meanwhile, or another thread with its tid was; and for its own one again where
// that ran later.
std::vector<Conjunction> excuses_of(const RuleContext& context, ThreadIndex index,
                                    const Announcement& announced, const ForeignStart& start) {
  const auto& model = context.model;
  const auto& known = context.known;
  const auto foreign = start.at.time;
  auto last = announced.at.time;
  auto next = foreign;
  for (const auto* pair : model.threads[at(index)].ran) {
    if (!serves(model, model.threads[at(index)], announced, model.callbacks[at(pair->callback)]))
      continue;
    const auto own = pair->last_activity.time;
    if (own < foreign) last = std::max(last, own);
    if (own > foreign && own <= announced.next) next = std::max(next, own);
  }
  const auto announcement = [&](Timestamp from, Timestamp to) {
    return hidden(EventKind::announcement, known.scope_of(index), from, to);
  };
  Conjunction anew{announcement(start.since, foreign)};
  if (next > foreign) return {{anew.front(), announcement(foreign, next)}};
  auto excuses = known.replaced(index, last, foreign);
  excuses.push_back(std::move(anew));
  return excuses;
}

void judge_foreign_callbacks(const RuleContext& context, ThreadIndex index, Judgement& judgement) {
  const auto& thread = context.model.threads[at(index)];
  const auto announcements = announcements_of(thread);
  if (thread.former.size() == kMostFormer) {
    judgement.unseen(
        evidence("thread_init", announcements.back().at, note("announced-for-too-many")));
    return;
  }
  for (const auto* pair : thread.ran) {
    const auto& callback = context.model.callbacks[at(pair->callback)];
    judgement.checked(pair->starts);
    const auto found = ownership_of(context.model, announcements, thread, callback, *pair);
    if (found.ownership == Ownership::own) continue;
    if (found.ownership == Ownership::unknown) {
      judgement.unseen(
          without_event(found.at, note("perhaps-started-foreign-callback",
                                       {{"callback", NamedCallback{callback.logical_id}}})));
      continue;
    }
    const auto& announced = in_force(announcements, found.start.at.time);
    if (auto perhaps =
            perhaps_told_by_own(context.model, context.proof, context.losses, callback)) {
      judgement.unseen(*std::move(perhaps));
      continue;
    }
    if (!callback.registered) {
      judgement.unseen(without_event(
          found.start.at,
          note("registration-unseen-group", {{"callback", NamedCallback{callback.logical_id}}})));
      continue;
    }
    judgement.violation([&] { return foreign_start(callback, *pair, announced, found.start); },
                        excuses_of(context, index, announced, found.start));
  }
}

// Of an isolated thread on which no callback was seen to run, and no total tells that none did: what it
// did may have been in callbacks.
std::optional<Evidence> perhaps_in_callbacks(const RuleContext& context, ThreadIndex index) {
  const auto& thread = context.model.threads[at(index)];
  if (!is_isolated(thread) || !thread.ran.empty()) return std::nullopt;
  const auto owner = context.isolated.idle_owner(index);
  if (owner && context.model.callbacks[at(*owner)].fini)
    return std::nullopt;  // of which nothing is lost
  return context.proof.incompleteness(thread.process);
}

// From when on a wait of the thread would have been its first one.
Timestamp work_begins(const RuleContext& context, const ThreadFacts& thread) {
  auto begin = *thread.first_wait;
  if (thread.announced) begin = std::min(begin, thread.announced->time);
  if (!thread.ran.empty()) begin = std::min(begin, thread.ran.front()->first_start.time);
  const auto& window = context.options.window;
  return window ? std::max(begin, std::min(window->from, *thread.first_wait)) : begin;
}

// Why the foreign work of a thread is not known of which the kernel's record is whole.
Note why_unmeasured(const Model& model, const ThreadFacts& thread) {
  const auto host = model.processes[at(thread.process)].host;
  if (!model.hosts[at(host)].has_switches) return note("no-switches-to-measure-foreign-work");
  if (!thread.first_wait && thread.is_known_to_kernel) return note("never-waited");
  return note("foreign-work-has-gaps");
}

void judge_foreign_time(const RuleContext& context, ThreadIndex index, const SpecEntry& entry,
                        Judgement& judgement) {
  const auto& model = context.model;
  const auto& thread = model.threads[at(index)];
  const EventRef end = moment(context.lives.of(index).latest_end(), thread.tid);
  // What lost instances did would count as foreign work; or its time is another one.
  if (const auto read_backs = context.known.read_backs(index);
      context.known.may_be_hidden(read_backs)) {
    judgement.needs_none(read_backs);
    return;
  }
  if (const auto lost = context.losses.on(index)) {
    judgement.needs(context.known.lost_end(*lost));
    return;
  }
  const bool is_unread = is_never_read_back(model, thread);
  if (thread.kernel_exit && !thread.fini && !is_unread) {
    judgement.unseen(evidence(std::string(thread.kernel_exit_event), *thread.kernel_exit,
                              note("end-of-work-unseen")));
    return;
  }
  const auto host = model.processes[at(thread.process)].host;
  // What was not recorded before the first wait that was seen may hide the first one.
  const auto loss = thread.first_wait
                        ? context.holes.since(host, work_begins(context, thread), end.time)
                        : context.kernel_record.loss(index);
  if (!thread.foreign || !thread.first_wait) {
    judgement.unseen(loss ? *loss : without_event(end, why_unmeasured(model, thread)));
    return;
  }
  const auto& work = *thread.foreign;
  const bool is_whole = work.is_whole && !loss;
  if (is_whole && work.span == Duration{0}) return;  // it was over before the window
  // To where the work was counted no event need stand.
  const auto counted_to = *thread.first_wait + work.span;
  // The longest time that it may be work of.
  const auto earliest = work_begins(context, thread);
  const auto begin =
      context.holes.since(host, earliest, *thread.first_wait) ? earliest : *thread.first_wait;
  const auto span = is_whole ? work.span : std::max(counted_to, end.time) - begin;
  const auto budget = *entry.foreign_work_budget_ns;
  // seen / span > budget / second, in whole nanoseconds.
  const bool is_above =
      static_cast<Int128>(work.seen.ns) * 1'000'000'000 > static_cast<Int128>(budget) * span.ns;
  if (!is_whole && (!is_above || context.lives.may_be_another(index, counted_to))) {
    judgement.unseen(loss ? *loss : without_event(end, why_unmeasured(model, thread)));
    return;
  }
  judgement.checked();
  if (is_unread) {
    judgement.remark(evidence("sampled", moment(*thread.first_wait, thread.tid),
                              note("thread-of-one-callback-unannounced")));
  }
  if (!is_above) return;
  judgement.violation_unless(
      listed({perhaps_in_callbacks(context, index)}),
      {evidence("sched_switch", moment(*thread.first_wait, thread.tid),
                note("foreign-work-counted-from-here")),
       without_event(moment(counted_to, thread.tid),
                     note(is_whole ? "foreign-work" : "foreign-work-at-least",
                          {{"work", work.seen},
                           {"span", span},
                           {"spec", place(context, entry.line)},
                           {"budget", Duration{budget}}}))});
}

bool asks_for_budgets(const SchedulingSpec* spec) {
  const auto has_budget = [](const SpecEntry& entry) {
    return entry.foreign_work_budget_ns.has_value();
  };
  return spec != nullptr && (std::ranges::any_of(spec->callbacks(), has_budget) ||
                             std::ranges::any_of(spec->threads(), has_budget));
}

std::vector<SubjectVerdict> judge_foreign_work(const RuleContext& context) {
  const auto& unknown = context.unknown_threads;
  const bool has_budgets = asks_for_budgets(context.options.spec);
  auto verdicts = judge_threads(
      context, [&](ThreadIndex index, const ThreadFacts& thread, Judgement& judgement) {
        need_no_others(context, index, judgement);
        // It may be one that has a budget.
        if (has_budgets && !thread.announced) judgement.unseen(context.proof.loss(index));
        if (is_never_read_back(context.model, thread)) {
          const auto* entry = sole_entry(context, thread);
          if (entry != nullptr && entry->foreign_work_budget_ns) {
            judge_foreign_time(context, index, *entry, judgement);
            return;
          }
        }
        if (const auto found = unknown.find(index); found != unknown.end()) {
          judgement.unseen(found->second);
        }
        const bool is_worker = thread.announced && thread.role == ThreadRole::worker;
        if (is_isolated(thread)) {
          judge_foreign_callbacks(context, index, judgement);
          if (const auto lost = context.losses.on(index))
            judgement.needs(context.known.lost_end(*lost));
        }
        if (is_isolated(thread) || is_worker) {
          const auto* entry = spec_entry_of(context, index);
          if (entry == nullptr || !entry->foreign_work_budget_ns) return;
          if (thread.former.empty()) {
            judge_foreign_time(context, index, *entry, judgement);
          } else {
            judgement.unseen(evidence("thread_init", thread.former.back().next,
                                      note("foreign-work-of-unknown-callback")));
          }
        }
      });
  note_missing_vtid(context, verdicts);
  return verdicts;
}

}  // namespace

const Rule kNoForeignWork{
    .id = "M6",
    .name = "no-foreign-work",
    .meaning =
        "An isolated thread works for its own callback alone: it starts none of another group (what "
        "else its group holds, M8 judges), and its work outside callbacks stays within foreign_work_budget (nanoseconds per second; without one "
        "it is not judged). Of a thread that is announced anew for another callback each start is "
        "judged by the announcement before it.",
    .why_it_matters =
        "Work that no callback accounts for delays the callback at its own priority, and no "
        "analysis of callbacks sees it.",
    .inconclusive_when =
        "a callback on it lost instances or was not seen to be registered, another one may have been lost with all of its "
        "instances, a callback started on it before it was seen to be announced or where another "
        "announcement may be lost, the context vtid is absent, it may have served what ROS 2's "
        "events do not show (M2), or (for the budget) there are no kernel events, their record has "
        "a hole or begins after the thread and what they show is within the budget, or read-backs or the end of the "
        "thread were lost, or no callback was seen on it and no total tells that none ran.",
    .remedy =
        "register the callback to the thread that runs it; move other work to a thread of its own "
        "(Executor::spawn_thread); record with --kernel.",
    .remedy_rclcpp =
        "let the thread spin for the callback's group alone; move other work to a thread of its "
        "own; record with --kernel.",
    .violation = "did other work",
    .judge = judge_foreign_work,
    .needs = {.instances = true}};

}  // namespace cie::analysis
