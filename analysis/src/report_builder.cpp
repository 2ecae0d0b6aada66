#include "report_builder.hpp"

#include <cie/tracepoints/scheduling_spec.hpp>

#include "host_clocks.hpp"
#include "host_gaps.hpp"
#include "subjects.hpp"
#include "wall_clock.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::size_t kMaxPreemptorsShown = 16;

bool is_pass(const VerdictReport& verdicts, std::string_view rule) {
  return std::none_of(verdicts.rules.begin(), verdicts.rules.end(), [rule](const RuleVerdict& r) {
    return r.id == rule && (r.verdict == Verdict::fail || r.verdict == Verdict::inconclusive);
  });
}

bool is_subject_pass(const VerdictReport& verdicts, std::string_view rule,
                     const std::string& subject) {
  for (const auto& r : verdicts.rules) {
    if (r.id != rule) continue;
    for (const auto& s : r.subjects) {
      if (s.subject == subject) {
        return s.verdict == Verdict::pass || s.verdict == Verdict::not_applicable;
      }
    }
  }
  return true;
}

void add_defect(std::vector<TraceDefect>& defects, std::string kind, Severity severity,
                std::uint64_t count, std::string advice) {
  if (count == 0) return;
  defects.push_back(TraceDefect{
      .kind = std::move(kind), .severity = severity, .count = count, .advice = std::move(advice)});
}

std::uint64_t count_losses(const Model& model, LossKind kind) {
  std::uint64_t total = 0;
  for (const auto& loss : model.losses) {
    if (loss.kind == kind) total += loss.count.value_or(1);
  }
  return total;
}

template <typename Range, typename Count>
std::uint64_t total_of(const Range& range, Count count) {
  return std::accumulate(
      range.begin(), range.end(), std::uint64_t{0},
      [&count](std::uint64_t sum, const auto& item) { return sum + count(item); });
}

// Pairs of hosts whose fastest messages both ways took less than nothing together.
std::uint64_t contradictory_clocks(const Model& model) {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(model.host_clocks, [&model](const auto& entry) {
        const auto& [from, to] = entry.first;
        return from < to && clock_error(model, entry.first).is_contradiction();
      }));
}

std::vector<TraceDefect> defects_of(const Model& model) {
  std::vector<TraceDefect> defects;
  add_defect(defects, "damaged-packets", Severity::error,
             count_losses(model, LossKind::damaged_packet),
             "some packets could not be read and were skipped; what they held is missing");
  add_defect(
      defects, "foreign-metadata", Severity::error, count_losses(model, LossKind::foreign_metadata),
      "read with other metadata than its own, which is lost: right only as far as both agree");
  add_defect(defects, "discarded-events", Severity::loss,
             count_losses(model, LossKind::discarded_events),
             "the tracer's buffers were full: record with larger or more sub-buffers");
  add_defect(
      defects, "discarded-packets", Severity::loss,
      count_losses(model, LossKind::discarded_packets),
      "whole packets are missing: use discard mode, larger buffers, or look for a lost file");
  add_defect(defects, "sched-switch-gaps", Severity::loss,
             count_losses(model, LossKind::switch_mismatch),
             "the kernel's record misses switches: execution times around them are not measured");
  add_defect(defects, "losses-not-listed", Severity::info, model.losses_dropped,
             "more losses than are kept one by one; they are still losses");
  add_defect(defects, "time-runs-backwards", Severity::error, model.time_regressions.count,
             "a stream's clock went back: its times cannot be trusted");
  add_defect(defects, "clocks-unrelated", Severity::error, model.clocks_unrelated ? 1 : 0,
             "the traces do not share a boot id: times of different streams cannot be compared");
  add_defect(defects, "clocks-drifted", Severity::error, contradictory_clocks(model),
             "messages between two hosts arrive before they were sent, whatever the difference of "
             "their clocks: it changed meanwhile; synchronise them, or report a shorter --window");
  for (const auto& gap : host_gaps(model))
    add_defect(defects, "host-gap", Severity::loss, 1, in_words(gap, model));
  add_defect(defects, "seq-gaps", Severity::loss,
             total_of(model.callbacks, [](const auto& c) { return c.starts.missing; }),
             "instances are missing from the record; figures of their callbacks are incomplete");
  add_defect(defects, "publish-gaps", Severity::loss,
             total_of(model.publishers, [](const auto& p) { return p.published.missing; }),
             "publications are missing from the record; chains through them are incomplete");
  add_defect(defects, "read-back-gaps", Severity::loss,
             total_of(model.threads, [](const auto& t) { return t.read_backs.missing; }),
             "scheduling read-backs are missing from the record");
  add_defect(defects, "ends-without-start", Severity::loss,
             total_of(model.callbacks, [](const auto& c) { return c.ends_without_start; }),
             "an instance's start is missing; it is not counted");
  add_defect(defects, "repeated-ends", Severity::error,
             total_of(model.callbacks, [](const auto& c) { return c.second_ends; }),
             "an instance ended twice: the traced program does not pair its events");
  add_defect(defects, "open-instances", Severity::info,
             total_of(model.callbacks, [](const auto& c) { return c.open_count; }),
             "started but never ended in this trace; listed, not counted");
  add_defect(defects, "instances-cut-by-window", Severity::info,
             total_of(model.callbacks, [](const auto& c) { return c.cut_instances; }),
             "they overlap an edge of what all streams cover; listed, not counted");
  add_defect(defects, "unregistered-callbacks", Severity::loss,
             total_of(model.callbacks,
                      [](const auto& c) { return std::uint64_t{!c.registered.has_value()}; }),
             "no callback_init was seen: record from the start, or attach for more than a second");
  add_defect(defects, "identity-failures", Severity::error,
             total_of(model.callbacks, [](const auto& c) { return c.identity_failures; }),
             "execution, preempted, blocked and wake delay do not add up to the duration");
  add_defect(defects, "incomplete-chains", Severity::loss,
             total_of(model.chains, [](const auto& c) { return c.incomplete; }),
             "a message's publication was not seen; those chain instances are not measured");
  const auto missing_marker = [&model](auto has) {
    return total_of(model.processes, [has](const ProcessFacts& p) {
      return std::uint64_t{p.has_cie_events && !has(p)};
    });
  };
  add_defect(defects, "missing-run-begin", Severity::loss,
             missing_marker([](const ProcessFacts& p) { return p.run_begin.has_value(); }),
             "the beginning of a process's run was not recorded");
  add_defect(defects, "missing-run-end", Severity::info,
             missing_marker([](const ProcessFacts& p) { return p.run_end.has_value(); }),
             "a process was still running, or was interrupted, when the recording ended");
  add_defect(
      defects, "shared-pid", Severity::error,
      total_of(model.processes,
               [](const ProcessFacts& p) { return std::uint64_t{p.shares_pid_since.has_value()}; }),
      "processes of one pid ran at once, and their events cannot be told apart: record containers "
      "one by "
      "one; run a program that forks without exec() with LD_PRELOAD=liblttng-ust-fork.so.1");
  add_defect(defects, "contract-too-new", Severity::error,
             total_of(model.processes,
                      [](const ProcessFacts& p) {
                        return std::uint64_t{p.contract_version > kContractVersion};
                      }),
             "the trace follows a newer contract than this program knows: update cie");
  return defects;
}

TraceSummary summary_of(const Model& model, const VerdictReport& verdicts) {
  TraceSummary trace;
  trace.paths = model.paths;
  trace.begin = model.begin;
  trace.end = model.end;
  trace.clock_offset_ns = clock_offset_ns(model);
  trace.begin_realtime_ns = begin_realtime_ns(model);
  trace.events = model.events.total;
  trace.streams = model.streams.size();
  for (const auto& host : model.hosts)
    trace.hosts.push_back(host.name);
  std::sort(trace.hosts.begin(), trace.hosts.end());
  for (const auto& loss : model.losses) {
    if (loss.kind == LossKind::switch_mismatch || loss.kind == LossKind::damaged_packet ||
        loss.kind == LossKind::foreign_metadata) {
      continue;
    }
    if (loss.kind == LossKind::discarded_packets || !loss.count) {
      trace.lost_events.reset();
    } else if (trace.lost_events) {
      *trace.lost_events += *loss.count;
    }
  }
  trace.complete = is_pass(verdicts, "T2") && is_pass(verdicts, "T3") && is_pass(verdicts, "T4");
  return trace;
}

const std::string& host_of(const Model& model, ProcessIndex process) {
  return model.hosts[at(model.processes[at(process)].host)].name;
}

std::optional<ReleaseSource> release_source_of(const CallbackFacts& facts) {
  std::optional<ReleaseSource> source;
  for (std::size_t i = 0; i < facts.by_release_source.size(); ++i) {
    if (facts.by_release_source[i] == 0) continue;
    source = source ? ReleaseSource::mixed : static_cast<ReleaseSource>(i);
  }
  return source;
}

CallbackReport report_of(const Model& model, CallbackIndex index, bool keep_buckets) {
  const auto& facts = model.callbacks[at(index)];
  CallbackReport report;
  report.index = static_cast<std::uint32_t>(index);
  report.host = host_of(model, facts.process);
  report.logical_id = facts.logical_id;
  report.pid = model.processes[at(facts.process)].pid;
  report.host_number = static_cast<std::uint32_t>(model.processes[at(facts.process)].host);
  report.node = facts.node;
  report.kind = facts.kind ? std::string(label(*facts.kind)) : std::string{};
  report.source = facts.source;
  report.symbol = facts.symbol;
  if (facts.period_ns > 0) report.period_ns = facts.period_ns;
  if (facts.deadline_ns > 0) report.deadline_ns = facts.deadline_ns;
  if (facts.group) report.group = to_number(*facts.group);
  for (const auto& pair : facts.ran_on) {
    const auto& thread = model.threads[at(pair.thread)];
    report.threads.push_back(
        CallbackThread{.tid = thread.tid, .name = thread.name, .instances = pair.instances});
  }
  std::stable_sort(report.threads.begin(), report.threads.end(),
                   [](const auto& a, const auto& b) { return a.tid < b.tid; });
  report.isolated = facts.ran_on.size() == 1 && facts.starts_without_tid == 0 &&
                    model.threads[at(facts.ran_on.front().thread)].ran.size() == 1;
  report.instances = facts.instances;
  report.incomplete = facts.open_count;
  if (facts.kind == CallbackKind::timer && facts.is_accounted)
    report.missed_releases = facts.missed;
  report.release_source = release_source_of(facts);
  report.response_time = facts.response_time.summary(keep_buckets);
  report.response_time_lower = facts.response_time_lower.summary(keep_buckets);
  report.response_time_upper = facts.response_time_upper.summary(keep_buckets);
  report.start_latency = facts.start_latency.summary(keep_buckets);
  report.duration = facts.duration.summary(keep_buckets);
  report.inter_arrival = facts.inter_arrival.summary(keep_buckets);
  report.execution_time = facts.execution_time.summary(keep_buckets);
  report.preempted = facts.preempted.summary(keep_buckets);
  for (const auto& [tid, preemptor] : facts.preempted_by)
    report.preempted_by.push_back(preemptor);
  std::ranges::stable_sort(report.preempted_by, std::ranges::greater{}, &Preemptor::time);
  if (report.preempted_by.size() > kMaxPreemptorsShown) {
    report.preempted_by.resize(kMaxPreemptorsShown);
  }
  report.blocked = facts.blocked.summary(keep_buckets);
  report.wake_delay = facts.wake_delay.summary(keep_buckets);
  report.wakeup_latency = facts.wakeup_latency.summary(keep_buckets);
  return report;
}

ThreadReport report_of(const Model& model, const ThreadFacts& facts) {
  ThreadReport report;
  report.host = host_of(model, facts.process);
  report.pid = model.processes[at(facts.process)].pid;
  report.host_number = static_cast<std::uint32_t>(model.processes[at(facts.process)].host);
  report.tid = facts.tid;
  report.name = facts.name;
  if (facts.role) report.role = std::string(label(*facts.role));
  for (const auto& pair : facts.ran) {
    report.callbacks.push_back(model.callbacks[at(pair.callback)].logical_id);
  }
  std::sort(report.callbacks.begin(), report.callbacks.end());
  if (const auto& last = facts.last_read_back) {
    report.sched = ThreadSchedReport{
        .moment = last->moment ? std::string(label(*last->moment)) : std::string{},
        .policy = last->policy,
        .policy_name = std::string(policy_name(static_cast<Policy>(last->policy))),
        .flags = last->flags,
        .nice = last->nice,
        .priority = last->priority,
        .runtime_ns = last->runtime_ns,
        .deadline_ns = last->deadline_ns,
        .period_ns = last->period_ns,
        .cpus = last->cpus,
        .error = last->error,
        .slice_ns = asked_for(facts, *last, &ReadBack::slice_ns),
        .util_min = asked_for(facts, *last, &ReadBack::util_min),
        .util_max = asked_for(facts, *last, &ReadBack::util_max)};
  }
  report.busy_ns = facts.busy_ns;
  return report;
}

GraphEdge report_of(const Model& model, const MessageEdgeFacts& facts) {
  const auto node = [&model](CallbackIndex index) {
    const auto& callback = model.callbacks[at(index)];
    return GraphNode{.logical_id = callback.logical_id,
                     .pid = model.processes[at(callback.process)].pid};
  };
  GraphEdge edge;
  if (facts.from) edge.from = node(*facts.from);
  edge.to = node(facts.to);
  edge.topic = model.callbacks[at(facts.to)].source;
  edge.messages = facts.messages;
  edge.communication = facts.communication.summary();
  if (facts.crosses) edge.clock_error = clock_error(model, *facts.crosses);
  return edge;
}

// Each pair once, in the order of its names.
std::vector<HostClockReport> clocks_of(const Model& model) {
  std::map<std::pair<std::string, std::string>, HostClockReport> pairs;
  for (const auto& [from_to, facts] : model.host_clocks) {
    const auto& from = model.hosts[at(from_to.first)].name;
    const auto& to = model.hosts[at(from_to.second)].name;
    const bool is_there = from < to;
    auto& pair = pairs[std::minmax(from, to)];
    (is_there ? pair.messages_there : pair.messages_back) = facts.messages;
    (is_there ? pair.fastest_there_ns : pair.fastest_back_ns) = facts.shortest.ns;
  }
  std::vector<HostClockReport> reports;
  for (auto& [names, pair] : pairs) {
    std::tie(pair.first, pair.second) = names;
    if (pair.fastest_there_ns && pair.fastest_back_ns) {
      // Each is half the way, plus or minus what the clocks differ by.
      pair.ahead_ns = (*pair.fastest_there_ns - *pair.fastest_back_ns) / 2;
      pair.error_ns = (*pair.fastest_there_ns + *pair.fastest_back_ns) / 2;
    }
    reports.push_back(std::move(pair));
  }
  return reports;
}

ChainReport report_of(const Model& model, const ChainFacts& facts) {
  ChainReport report;
  report.name = facts.name;
  if (facts.process) report.pid = model.processes[at(*facts.process)].pid;
  report.hops = facts.hops;
  report.instances = facts.instances;
  report.path_latency = facts.path_latency.summary();
  report.reaction_time = facts.reaction_time.summary();
  report.data_age = facts.data_age.summary();
  report.clock_error = clock_error(model, facts);
  for (std::size_t i = 0; i < facts.processing.size() && i < facts.hops.size(); ++i) {
    const auto processing = facts.processing[i].summary();
    if (!processing) continue;
    HopReport hop{.from = facts.hops[i],
                  .to = std::nullopt,
                  .processing = *processing,
                  .communication = std::nullopt};
    if (i + 1 < facts.hops.size()) {
      hop.to = facts.hops[i + 1];
      hop.communication = facts.communication[i].summary();
      hop.clock_error = clock_error(model, facts, i);
    }
    report.hop_table.push_back(std::move(hop));
  }
  return report;
}

}  // namespace

std::string_view label(Severity severity) noexcept {
  switch (severity) {
    case Severity::info:
      return "info";
    case Severity::loss:
      return "loss";
    case Severity::error:
      break;
  }
  return "error";
}

std::string_view label(ReleaseSource source) noexcept {
  switch (source) {
    case ReleaseSource::exact:
      return "exact";
    case ReleaseSource::wakeup:
      return "wakeup";
    case ReleaseSource::source_timestamp:
      return "source_timestamp";
    case ReleaseSource::start:
      return "start";
    case ReleaseSource::mixed:
      return "mixed";
  }
  return {};
}

Report build_report(const Model& model, const VerdictReport& verdicts, bool keep_buckets) {
  Report report;
  report.trace = summary_of(model, verdicts);
  report.defects = defects_of(model);
  const Subjects subjects(model);

  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!process.has_cie_events) continue;
    ProcessReport entry{
        .host = model.hosts[at(process.host)].name,
        .boot_id = process.boot_id,
        .pid_ns = process.pid_ns,
        .has_ended = process.run_end.has_value(),
        .pid = process.pid,
        .name = process.name,
        .executor = std::nullopt,
        .complete = is_subject_pass(verdicts, "T4",
                                    subjects.process(ProcessIndex{static_cast<std::uint32_t>(i)})),
        .host_number = static_cast<std::uint32_t>(process.host)};
    if (!process.executor.empty()) entry.executor = process.executor;
    report.processes.push_back(std::move(entry));
  }
  std::stable_sort(report.processes.begin(), report.processes.end(),
                   [](const auto& a, const auto& b) {
                     return std::tie(a.host, a.pid) < std::tie(b.host, b.pid);
                   });

  for (const auto index : callbacks_in_order(model)) {
    report.callbacks.push_back(report_of(model, index, keep_buckets));
  }
  for (const auto& thread : model.threads) {
    if (thread.announced || !thread.ran.empty()) {
      report.threads.push_back(report_of(model, thread));
    }
  }
  std::stable_sort(report.threads.begin(), report.threads.end(), [](const auto& a, const auto& b) {
    return std::tie(a.pid, a.tid) < std::tie(b.pid, b.tid);
  });
  for (const auto& chain : model.chains)
    report.chains.push_back(report_of(model, chain));
  report.clocks = clocks_of(model);
  for (const auto& edge : model.edges)
    report.edges.push_back(report_of(model, edge));
  std::ranges::stable_sort(report.edges, {}, [](const GraphEdge& edge) {
    return std::tie(edge.to, edge.from, edge.topic);
  });
  return report;
}

}  // namespace cie::analysis
