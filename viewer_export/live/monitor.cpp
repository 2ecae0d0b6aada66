#include "monitor.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/response_time.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "names.hpp"
#include "text/verify_findings.hpp"
#include "words/verify_words.hpp"

#include <algorithm>
#include <string>
#include <utility>

namespace cie::live {
namespace {

using analysis::Instance;
using analysis::InstanceState;
using analysis::Timestamp;
using std::chrono::duration_cast;
using std::chrono::nanoseconds;
using std::chrono::steady_clock;

std::size_t class_of(std::int64_t response_ns) {
  const auto* found = std::lower_bound(kResponseBounds.begin(), kResponseBounds.end(), response_ns);
  return static_cast<std::size_t>(found - kResponseBounds.begin());
}

void count_losses(const analysis::Report& report, Snapshot& snapshot) {
  snapshot.lost_events = report.trace.lost_events;
  for (const auto& defect : report.defects) {
    if (defect.kind == analysis::DefectKind::discarded_packets)
      snapshot.lost_packets = defect.count;
    snapshot.defects.push_back({.kind = std::string(label(defect.kind)),
                                .severity = std::string(label(defect.severity)),
                                .count = defect.count});
  }
}

void name(Snapshot& snapshot) {
  const Names names(snapshot, {.unicode = true});
  for (auto& callback : snapshot.callbacks)
    callback.name = names.of(callback);
  const auto say = [&names](auto& verdict) { verdict.says = names.in_words(verdict.says); };
  std::ranges::for_each(snapshot.verdicts, say);
  std::ranges::for_each(snapshot.changes, say);
}

}  // namespace

std::string_view label(SourceState state) noexcept {
  switch (state) {
    case SourceState::waiting:
      return "waiting";
    case SourceState::streaming:
      return "streaming";
    case SourceState::silent:
      return "silent";
    case SourceState::lost:
      return "lost";
    case SourceState::ended:
      break;
  }
  return "ended";
}

void Monitor::on_instance(const Instance& instance) {
  if (instance.state != InstanceState::complete) return;
  auto& callback = callbacks_[instance.callback];
  const auto least = *analysis::least_response_time(instance);
  const bool is_exact = is_known(instance.release_source);
  const auto response = *analysis::response_time_or_bound(instance);
  const bool is_late = instance.response_deadline && least > *instance.response_deadline;
  callback.rolling.add(*instance.end, response, is_late, instance.missed.value_or(0));
  ++callback.counts[class_of(response.ns)];
  // Damaged traces have any times: sums wrap.
  callback.response_sum_ns = analysis::detail::wrapping_add(callback.response_sum_ns, response.ns);
  callback.late += is_late ? 1 : 0;
  callback.is_exact = callback.is_exact && is_exact;
  callback.last_response_ns = response.ns;
  callback.last_end_ns = instance.end->ns;
  heard_ = instance.host;
  const auto [clock, is_first] = clocks_.try_emplace(instance.host);
  if (is_first) clock->second.first = instance.start;
  clock->second.latest = std::max(clock->second.latest, *instance.end);
  if (callback.recent.size() >= kMaxRecent) callback.recent.pop_front();
  RecentInstance recent{.seq = instance.seq,
                        .tid = instance.tid,
                        .cpu = instance.cpu_start,
                        .start_ns = instance.start.ns,
                        .end_ns = instance.end->ns,
                        .response_ns = response.ns,
                        .is_exact = is_exact,
                        .is_late = is_late,
                        .missed = instance.missed.value_or(0),
                        .execution_ns = {}};
  if (instance.execution) recent.execution_ns = instance.execution->ns;
  callback.recent.push_back(recent);
}

// The trace's clock is ours, or that of another machine: it goes on while nothing comes.
Timestamp Monitor::HostClock::present(steady_clock::time_point now) {
  if (!seen || seen->first != latest) seen = {latest, now};
  return latest + analysis::Duration{duration_cast<nanoseconds>(now - seen->second).count()};
}

// Since its last instance; where it had none, since the end of its process was seen.
analysis::Duration Monitor::OfCallback::age(Timestamp now, steady_clock::time_point time) const {
  if (last_end_ns) return now - Timestamp{*last_end_ns};
  return {duration_cast<nanoseconds>(time - end_seen.value_or(time)).count()};
}

void Monitor::describe_callbacks(const analysis::AnalysisResult& result,
                                 steady_clock::time_point time, Snapshot& snapshot) {
  const auto& report = result.report;
  const auto missing_too_many =
      viewer_export::callbacks_violating(result.verdicts, analysis::kNoMissedReleaseRule);
  const analysis::ReportRows rows(report);
  for (const auto& known : report.callbacks) {
    const auto& process = rows.process_of(known);
    const auto clock = clocks_.find(process.host_index);
    const auto now = clock != clocks_.end() ? clock->second.present(time) : Timestamp{};
    CallbackView view;
    view.has_ended = process.has_ended || cpu_.is_gone(known.process);
    auto found = callbacks_.find(known.index);
    if (found == callbacks_.end() && view.has_ended) continue;
    auto& mine = found != callbacks_.end() ? found->second : callbacks_[known.index];
    if (!view.has_ended) mine.end_seen.reset();
    if (view.has_ended && !mine.end_seen) mine.end_seen = time;
    if (view.has_ended && mine.age(now, time).ns > kKeptAfterEndNs) {
      callbacks_.erase(known.index);
      continue;
    }
    view.index = static_cast<std::uint32_t>(known.index);
    view.host = process.host;
    view.pid = process.pid;
    view.logical_id = known.logical_id;
    if (known.kind) view.kind = label(*known.kind);
    for (const auto& thread : known.threads)
      view.tids.push_back(thread.tid);
    view.isolation = known.isolation;
    view.period_ns = known.period_ns.value_or(0);
    if (known.response_deadline) {
      view.deadline_ns = known.response_deadline->ns;
      view.is_deadline_of_spec = known.deadline_ns != static_cast<std::uint64_t>(*view.deadline_ns);
    }
    const auto sum = mine.rolling.sum(now);
    view.instances = sum.instances;
    if (known.response_deadline) {
      view.late = sum.late + known.late_open.value_or(0);
      mine.late_told = std::max(mine.late_told, mine.late + known.late_open.value_or(0));
      view.total_late = mine.late_told;
    }
    if (known.missed_releases) view.missed = sum.missed;
    view.response = sum.response;
    view.total_instances = known.instances;
    view.total_missed = known.missed_releases;
    view.is_missing_too_many = missing_too_many.contains(view.index);
    view.total_response = known.response_time_or_bound();
    describe_open(known, view);
    view.is_exact = mine.is_exact;
    view.counts = mine.counts;
    view.response_sum_ns = mine.response_sum_ns;
    view.last_response_ns = mine.last_response_ns;
    view.last_end_ns = mine.last_end_ns;
    view.recent.assign(mine.recent.begin(), mine.recent.end());
    mine.recent.clear();
    snapshot.callbacks.push_back(std::move(view));
  }
}

void Monitor::describe_open(const analysis::CallbackReport& known, CallbackView& view) {
  if (!known.longest_open) return;
  const auto open = known.longest_open->until_end.ns;
  view.open_ns = open;
  view.open_late = known.late_open.value_or(0);
  view.is_open_certain = known.longest_open->response_least.has_value();
  const auto longest = view.total_response ? view.total_response->max : 0;
  view.is_open_long =
      view.open_late > 0 ||
      (view.deadline_ns ? open > *view.deadline_ns : open > std::max(longest, kOpenLongNs));
}

void Monitor::describe_threads(const analysis::Report& report, Snapshot& snapshot) {
  const analysis::ReportRows rows(report);
  for (const auto& thread : report.threads) {
    if (cpu_.is_gone(thread)) continue;
    const auto& process = rows.process_of(thread);
    snapshot.threads.push_back(
        {.index = static_cast<std::uint32_t>(thread.index),
         .host = process.host,
         .pid = process.pid,
         .tid = thread.tid,
         .name = thread.name,
         .role = thread.role ? std::string(label(*thread.role)) : std::string(),
         .callbacks = thread.callbacks,
         .cpu_percent = cpu_.of(thread)});
  }
}

Snapshot Monitor::describe(const analysis::AnalysisResult& result, steady_clock::time_point now) {
  const auto& report = result.report;
  Snapshot snapshot;
  snapshot.sequence = ++sequence_;
  const auto heard = clocks_.find(heard_);
  const auto latest = heard != clocks_.end() ? heard->second.latest : Timestamp{};
  snapshot.time_ns = latest.ns;
  snapshot.realtime_ns =
      duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
  snapshot.events = report.trace.events;
  const auto fresh = report.trace.events - std::exchange(events_, report.trace.events);
  if (now > described_) {
    snapshot.events_per_second =
        static_cast<double>(fresh) / std::chrono::duration<double>(now - described_).count();
  }
  described_ = now;
  snapshot.state = snapshot.events == 0 ? SourceState::waiting
                   : fresh == 0         ? SourceState::silent
                                        : SourceState::streaming;
  count_losses(report, snapshot);
  for (auto& [host, clock] : clocks_) {
    const auto present = clock.present(now);
    auto window_ns = Rolling::covered(present).ns;
    window_ns = std::min(window_ns, (present - clock.first).ns);
    snapshot.window_ns = std::max(snapshot.window_ns, window_ns);
  }
  cpu_.begin(report, now);
  describe_callbacks(result, now, snapshot);
  describe_threads(report, snapshot);
  cpu_.end();
  const bool is_here = std::any_of(report.processes.begin(), report.processes.end(),
                                   [this](const analysis::ProcessReport& p) {
                                     return p.host_index == heard_ && cpu_.is_local(p.index);
                                   });
  if (is_here && latest.ns > 0) {
    // CLOCK_MONOTONIC is std::chrono::steady_clock on Linux.
    snapshot.delay_ns = duration_cast<nanoseconds>(now.time_since_epoch()).count() - latest.ns;
  }
  const viewer_export::VerifyContext nothing_else{};
  const viewer_export::TextStyle style{.unicode = true};
  const viewer_export::Judged judged(result.verdicts, report, nothing_else, style);
  auto noted = verdicts_.note(result.verdicts, latest, [&judged](const auto& rule, const auto& of) {
    // Of a deadline the evidence says by how much it was missed.
    return rule.id == analysis::kDeadlineRule ? std::string() : told_of_violation(judged, rule, of);
  });
  snapshot.verdict = result.verdicts.verdict;
  snapshot.violations = std::move(noted.violations);
  snapshot.verdicts = std::move(noted.current);
  snapshot.verdicts_left_out = noted.left_out;
  snapshot.changes = std::move(noted.changes);
  name(snapshot);
  return snapshot;
}

}  // namespace cie::live
