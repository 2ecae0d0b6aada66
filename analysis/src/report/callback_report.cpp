#include "callback_report.hpp"

#include "base/prefetch.hpp"
#include "model/callback_questions.hpp"
#include "rules/callback_doubts.hpp"
#include "rules/judgement.hpp"
#include "rules/mapping_rules.hpp"
#include "rules/outlived_instances.hpp"
#include "rules/persistence_rule.hpp"
#include "rules/proof.hpp"
#include "rules/queue_losses.hpp"
#include "rules/signs_of_life.hpp"
#include "rules/thread_questions.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

namespace cie::analysis {
namespace {

std::optional<ReleaseSource> release_source_of(const CallbackFacts& facts) {
  std::optional<ReleaseSource> source;
  for (std::size_t i = 0; i < facts.by_release_source.size(); ++i) {
    if (facts.by_release_source[i] == 0) continue;
    source = source ? ReleaseSource::mixed : static_cast<ReleaseSource>(i);
  }
  return source;
}

bool are_periods_known(const CallbackFacts& facts) {
  return facts.kind == CallbackKind::timer &&
         (facts.is_accounted || (facts.has_grid_releases() && facts.grid.unresolved == 0));
}

// Whether its threads were one after the other, each replaced with a new callback_init, as M3 and M4
// judge. Empty: not known.
std::optional<bool> had_one_thread_at_a_time(const RuleContext& context, CallbackIndex index) {
  const auto& facts = context.model.callbacks[at(index)];
  Judgement judgement(context.names.callback(index), context.known);
  judgement.checked();
  SignsOfLife signs(context);
  judge_threads_together(context, signs, facts, judgement);
  claim_moves(context, index, judgement);
  const auto verdict = std::move(judgement).finish()->verdict;
  return verdict == Verdict::inconclusive ? std::nullopt : std::optional(verdict == Verdict::pass);
}

// False: what started and what ended may be instances of several processes.
bool is_paired(const Model& model, const CallbackFacts& facts) {
  const auto& process = model.processes[at(facts.process)];
  return !process.shares_pid_since || process.pid_sharing != PidSharing::crossed;
}

// Empty: some run's thread is unknown, or only its end was seen, or its thread may have served what
// nobody can see, or lived together with another one; and what is seen shows no sharing.
std::optional<Isolation> isolation_of(const RuleContext& context, CallbackIndex index) {
  const auto& model = context.model;
  const auto& facts = model.callbacks[at(index)];
  if (!is_paired(model, facts)) return std::nullopt;
  const auto is_doubtful = [&](const CallbackOnThread* pair) {
    return !pair->is_certain || may_be_former(context, model.threads[at(pair->thread)]);
  };
  const auto may_be_with_others = [&](const CallbackOnThread* pair) {
    const auto& ran = model.threads[at(pair->thread)].ran;
    return is_doubtful(pair) || ran.size() > 1;
  };
  const auto doubtful = std::ranges::count_if(facts.ran_on, is_doubtful);
  const auto is_with_others = [&](const CallbackOnThread* pair) {
    const auto is_another = [&](const CallbackOnThread* other) {
      return is_certainly_another(model, *other) &&
             !perhaps_told_by_own(context.model, context.proof, context.losses,
                                  model.callbacks[at(other->callback)]);
    };
    if (!is_another(pair)) return false;
    const auto& ran = model.threads[at(pair->thread)].ran;  // thousands, perhaps
    const auto first = std::ranges::find_if(ran, is_another);
    return std::find_if(std::next(first), ran.end(), is_another) != ran.end();
  };
  if (std::ranges::any_of(facts.ran_on, is_with_others)) return Isolation::not_isolated;
  if (std::ssize(facts.ran_on) - doubtful > 1) {
    const auto is_one = had_one_thread_at_a_time(context, index);
    if (is_one == false) return Isolation::not_isolated;
    if (!is_one) return std::nullopt;
  }
  if (std::ranges::any_of(facts.ran_on, may_be_with_others)) return std::nullopt;
  const auto may_have_run_others = [&context](const CallbackOnThread* pair) {
    return context.hidden.beside_own(pair->thread) || context.hidden.unseen_on(pair->thread);
  };
  if (std::ranges::any_of(facts.ran_on, may_have_run_others)) return std::nullopt;
  if (facts.starts_without_tid > 0) return std::nullopt;
  if (!facts.ran_on.empty()) return Isolation::isolated;
  return facts.ended.last ? std::nullopt : std::optional(Isolation::never_ran);
}

// Empty where a release or a start that is missing would change it.
std::optional<std::uint64_t> longest_queue(const Model& model, const Proof& proof,
                                           CallbackIndex index) {
  const auto& facts = model.callbacks[at(index)];
  if (facts.kind != CallbackKind::subscription || proof.loss(index)) return std::nullopt;
  if (!model.events.by_name.contains("callback_release")) return std::nullopt;
  const auto numbered = facts.first_release ? facts.last_release - *facts.first_release + 1 : 0;
  if (numbered != facts.releases) return std::nullopt;
  const auto next = facts.first_next_seq;
  const auto at_first = facts.left_unregistered > next ? facts.left_unregistered - next : 0;
  return std::max(facts.longest_queue, at_first);
}

// Sets what was lost of a callback's samples, if that is known: not of a timer, nor where totals are
// unknown or later ones may be missing. ROS 2's events tell no totals, but each sample that another
// one overwrites within a process.
void set_queue_losses(CallbackReport& report, const RuleContext& context, CallbackIndex index) {
  const auto& facts = context.model.callbacks[at(index)];
  if (facts.kind == CallbackKind::timer || !facts.registered) return;
  const auto losses = queue_losses(context, facts);
  const auto& proof = context.proof;
  const bool may_lack_later =
      !facts.fini &&
      (proof.loss(index) || context.user_losses.since(facts.process, facts.registered->time));
  if (may_lack_later) return;
  if (losses.are_totals_seen) report.lost_samples = losses.lost;
  const bool is_each_told =
      context.model.processes[at(facts.process)].is_from_ros2 && losses.overwritten > 0;
  if (losses.are_totals_seen || is_each_told) report.overwritten_samples = losses.overwritten;
  if (report.overwritten_samples && losses.is_overwritten_at_least)
    report.is_overwritten_at_least = true;
  if (!facts.may_repeat) return;
  const auto before = [](const std::optional<std::uint64_t>& total,
                         const std::optional<std::uint64_t>& at_first) {
    const auto most = std::min(at_first.value_or(total.value_or(0)), total.value_or(0));
    return most > 0 ? std::optional(most) : std::nullopt;
  };
  report.lost_before = before(report.lost_samples, facts.lost_at_first);
  report.overwritten_before = before(report.overwritten_samples, facts.overwritten_at_first);
}

// An instance whose end was lost: totals count it, or its callback was seen later on the same thread.
bool has_ended_unseen(const CallbackFacts& facts, const OpenInstance& open) {
  if (facts.fini && facts.fini->ended >= facts.fini->started) return true;
  return std::ranges::any_of(facts.ran_on, [&open](const CallbackOnThread* pair) {
    return pair->thread == open.thread && pair->last_activity.time > open.start.time;
  });
}

// Of a system that runs no window ends: it is there as long as its process tells of itself.
std::optional<Timestamp> end_of_open(const RuleContext& context, const CallbackFacts& facts,
                                     const OpenInstance& open) {
  const auto& last = context.model.processes[at(facts.process)].last_seen;
  if (context.options.is_live) return last ? std::optional(last->time) : std::nullopt;
  return end_of_window(context.model, open.start.stream);
}

// How long an open instance has taken at least. Empty: its end may be missing.
std::optional<Duration> least_response(const RuleContext& context, CallbackIndex index,
                                       const OpenInstance& open, Timestamp end) {
  const auto& facts = context.model.callbacks[at(index)];
  if (context.proof.loss(index)) return std::nullopt;
  const bool is_proven = has_unended(facts) && !context.proof.is_interrupted(facts.process);
  if (is_proven) return end - latest_release(open);
  if (!context.options.is_live) return std::nullopt;
  const auto outlived = analysis::outlived(context, facts, open);
  if (!outlived || outlived->doubt) return std::nullopt;
  return outlived->until - latest_release(open);
}

void set_open(CallbackReport& report, const RuleContext& context, CallbackIndex index) {
  const auto& facts = context.model.callbacks[at(index)];
  auto& longest = report.longest_open;
  for_each_open(facts, [&](const OpenInstance& open) {
    const auto end = end_of_open(context, facts, open);
    if (!end || *end < open.start.time || has_ended_unseen(facts, open)) return;
    const auto response = least_response(context, index, open, *end);
    if (response && facts.response_deadline && *response > *facts.response_deadline)
      report.late_open = report.late_open.value_or(0) + 1;
    const auto until_end = *end - open.start.time;
    if (longest && until_end <= longest->until_end) return;
    longest = OpenRun{.seq = open.seq, .until_end = until_end, .response_least = response};
  });
}

TimeWindow life_of(const RuleContext& context, const CallbackFacts& facts) {
  TimeWindow life;
  life.from = registration(context, facts).value_or(life.from);
  if (facts.fini) life.to = facts.fini->at.time;
  return life;
}

// Its quantities will be asked for soon: they lie far from each other.
void prefetch(const CallbackFacts& facts) {
  for (const auto* quantity :
       {&facts.response_time, &facts.start_latency, &facts.duration, &facts.inter_arrival}) {
    prefetch_to_read(quantity->memory());
  }
}

// Of instances whose release is known and of others.
void set_at_least(CallbackReport& report, const CallbackFacts& facts) {
  auto all = facts.response_time;
  all.merge(facts.is_lower_duration ? facts.duration : facts.response_time_lower);
  report.response_time_at_least = all.summary();
  // Where each of the others took longer than all of these, the median is this one.
  const auto middle = (all.count() + 1) / 2;
  // As near as the next bucket.
  const auto median = report.response_time_at_least->p50;
  const auto [least, greatest] = values_like(median);
  report.is_median_known = middle <= facts.response_time.count() &&
                           facts.response_time.at_rank(middle) - median <= greatest - least + 1;
}

void fill(CallbackReport& report, const RuleContext& context, CallbackIndex index) {
  const auto& model = context.model;
  const auto& facts = model.callbacks[at(index)];
  const bool keep_buckets = context.options.keep_buckets;
  report.index = index;
  report.process = facts.process;
  report.logical_id = facts.logical_id;
  report.lifetime = context.names.lifetime_of(index);
  report.node = facts.node;
  report.kind = facts.kind;
  report.source = facts.source;
  report.symbol = facts.symbol;
  if (facts.period_ns > 0) report.period_ns = facts.period_ns;
  if (facts.deadline_ns > 0) report.deadline_ns = facts.deadline_ns;
  if (!facts.may_be_another) report.response_deadline = facts.response_deadline;
  if (report.response_deadline)
    report.late = facts.are_releases_certain() ? facts.late : facts.late_by_duration;
  if (facts.group) report.group = to_number(*facts.group);
  for (const auto* pair : facts.ran_on) {
    const auto& thread = model.threads[at(pair->thread)];
    report.threads.push_back(CallbackThread{.thread = pair->thread,
                                            .tid = thread.tid,
                                            .name = thread.name,
                                            .instances = pair->instances});
  }
  std::stable_sort(report.threads.begin(), report.threads.end(),
                   [](const auto& a, const auto& b) { return a.tid < b.tid; });
  report.isolation = isolation_of(context, index);
  report.instances = facts.instances;
  report.incomplete = facts.open_count;
  report.cut = facts.cut_instances;
  const auto known = known_instances(model, facts);
  const auto outside = facts.outside ? facts.outside->count : 0;
  report.runs_not_seen = known - std::min(known, facts.starts.count - outside + facts.cut_by_begin);
  if (const auto left_out = left_out_instances(facts); left_out > 0)
    report.outside_window = left_out;
  report.may_lack_runs = context.proof.lost_runs(index).has_value();
  report.longest_unmeasured = facts.longest_unmeasured;
  if (is_paired(model, facts)) set_open(report, context, index);
  report.lived = life_of(context, facts);
  if (facts.min_inter_arrival && is_paired(model, facts))
    report.shortest_inter_arrival = facts.min_inter_arrival->value;
  if (facts.is_accounted && facts.without_status == 0) report.exceptions = facts.exceptions;
  report.longest_queue = longest_queue(model, context.proof, index);
  set_queue_losses(report, context, index);
  if (are_periods_known(facts)) report.missed_releases = facts.missed;
  report.release_source = release_source_of(facts);
  if (!is_paired(model, facts)) return;
  if (facts.has_grid_releases()) report.release_error = facts.release_error();
  report.response_time = facts.response_time.summary(keep_buckets);
  report.longest_response = facts.max_response_parts;
  report.response_time_upper = facts.response_time_upper.summary(keep_buckets);
  report.start_latency = facts.start_latency.summary(keep_buckets);
  report.duration = facts.duration.summary(keep_buckets);
  report.response_time_lower =
      facts.is_lower_duration ? report.duration : facts.response_time_lower.summary(keep_buckets);
  if (report.response_time && report.response_time_lower) {
    set_at_least(report, facts);
  }
  report.inter_arrival = facts.inter_arrival.summary(keep_buckets);
  report.execution_time = facts.execution_time.summary(keep_buckets);
  report.preempted = facts.preempted.summary(keep_buckets);
  report.longest_preempted_outside = facts.max_preempted_outside;
  if (facts.preempted_by) {
    for (const auto& [tid, preemptor] : *facts.preempted_by)
      report.preempted_by.push_back(preemptor);
    std::ranges::stable_sort(report.preempted_by, std::ranges::greater{}, &Preemptor::time);
  }
  report.blocked = facts.blocked.summary(keep_buckets);
  report.wake_delay = facts.wake_delay.summary(keep_buckets);
  report.wakeup_latency = facts.wakeup_latency.summary(keep_buckets);
}

}  // namespace

std::vector<CallbackReport> callback_reports(const RuleContext& context) {
  const auto& order = context.callbacks;
  std::vector<bool> shares_group(context.model.callbacks.size());
  for (const auto& group : context.model.groups) {
    if (group.type == GroupType::reentrant || group.callbacks.size() < 2) continue;
    for (const auto callback : group.callbacks)
      shares_group[at(callback)] = true;
  }
  std::vector<CallbackReport> reports;
  reports.reserve(order.size());
  const auto facts_of = [&](std::size_t i) -> const CallbackFacts& {
    return context.model.callbacks[at(order[i])];
  };
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + 2 < order.size()) prefetch_to_read(&facts_of(i + 2));
    if (i + 1 < order.size()) prefetch(facts_of(i + 1));
    fill(reports.emplace_back(), context, order[i]);
    reports.back().shares_group = shares_group[at(order[i])];
  }
  return reports;
}

}  // namespace cie::analysis
