#include "report_builder.hpp"

#include <cie/tracepoints/scheduling_spec.hpp>

#include "base/prefetch.hpp"
#include "callback_report.hpp"
#include "chain_report.hpp"
#include "model/callback_questions.hpp"
#include "model/clock_differences.hpp"
#include "model/recorded_parts.hpp"
#include "model/sort_rows.hpp"
#include "model/subjects.hpp"
#include "model/wall_clock.hpp"
#include "rules/completeness_rules.hpp"
#include "rules/parameter_words.hpp"
#include "rules/thread_questions.hpp"
#include "rules/trace_rules.hpp"
#include "trace_defects.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

// Null unless it was judged.
const RuleVerdict* verdict_of(const VerdictReport& verdicts, const Rule& rule) {
  const auto found = std::ranges::find(verdicts.rules, rule.id, &RuleVerdict::id);
  return found == verdicts.rules.end() ? nullptr : &*found;
}

bool is_pass(const VerdictReport& verdicts, const Rule& rule) {
  const auto* judged = verdict_of(verdicts, rule);
  return judged == nullptr || judged->verdict < Verdict::inconclusive;
}

// Recorded from its begin to its end. ROS 2 does not tell the end: nothing of it is known to be
// missing.
bool is_complete(const RuleContext& context, const std::map<ProcessIndex, Verdict>& runs,
                 ProcessIndex process) {
  const auto& facts = context.model.processes[at(process)];
  if (facts.is_from_ros2) {
    return has_begun_here(facts) &&
           std::ranges::none_of(context.model.losses, [&facts](const Loss& loss) {
             return loss.domain == Domain::user && loss.host == facts.host;
           });
  }
  const auto found = runs.find(process);
  return found == runs.end() || found->second < Verdict::inconclusive;
}

// Whether a process's run was recorded whole; those that were not judged are absent.
std::map<ProcessIndex, Verdict> verdicts_on_runs(const VerdictReport& verdicts) {
  std::map<ProcessIndex, Verdict> runs;
  const auto* judged = verdict_of(verdicts, kRunComplete);
  if (judged == nullptr) return runs;
  for (const auto& subject : judged->subjects) {
    const auto& about = subject.about;
    if (about.kind == SubjectKind::process) runs.emplace(*about.process, subject.verdict);
  }
  return runs;
}

// The tracer lost it: it is not what nobody recorded, or what was read badly.
bool is_of_tracer(LossKind kind) {
  return kind != LossKind::switch_mismatch && kind != LossKind::foreign_metadata &&
         kind != LossKind::host_gap;
}

// Of what any stream covers all of them cover the window.
std::optional<OutsideWindow> outside_window(const Model& model) {
  OutsideWindow outside;
  for (const auto& callback : model.callbacks)
    outside.instances += left_out_instances(callback);
  if (outside.instances == 0) return std::nullopt;
  const auto& any = model.covered_by_any;
  if (any && model.begin && model.end)
    outside.length = std::max((any->to - any->from) - (*model.end - *model.begin), Duration{});
  return outside;
}

TraceSummary summary_of(const RuleContext& context, const VerdictReport& verdicts) {
  const auto& model = context.model;
  TraceSummary trace;
  trace.paths = model.paths;
  trace.begin = model.begin;
  trace.end = model.end;
  trace.recording_begin = model.recording_begin;
  trace.outside = outside_window(model);
  trace.clock_offset_ns = clock_offset_ns(model);
  trace.begin_realtime_ns = begin_realtime_ns(model);
  trace.events = model.events.total;
  trace.streams = model.streams.size();
  for (const auto& host : model.hosts)
    trace.hosts.push_back(host.name);
  std::sort(trace.hosts.begin(), trace.hosts.end());
  for (const auto& loss : model.losses) {
    if (!is_of_tracer(loss.kind)) continue;
    const bool is_of_packets =
        loss.kind == LossKind::discarded_packets || loss.kind == LossKind::damaged_packet;
    if (is_of_packets || !loss.count) {
      trace.lost_events.reset();
    } else if (trace.lost_events) {
      *trace.lost_events += *loss.count;
    }
  }
  if (!context.proof.recorder_losses().empty()) trace.lost_events.reset();
  trace.complete = is_pass(verdicts, kNoLoss) && is_pass(verdicts, kSeqContiguous) &&
                   is_pass(verdicts, kRunComplete) && !missing_user_part(model) &&
                   std::ranges::none_of(recording_reports(model), begins_late);
  return trace;
}

// The time that some of the host's channels that are wanted cover: of sessions with a pause between
// them, without that.
template <typename IsWanted>
std::optional<Duration> recorded_by(const Model& model, HostIndex host, const IsWanted& is_wanted) {
  std::vector<TimeWindow> windows;
  for (const auto& [number, channel] : model.channels) {
    if (channel.host != host || !channel.begin || !channel.end || !is_wanted(channel)) continue;
    windows.push_back({.from = *channel.begin, .to = *channel.end});
  }
  std::ranges::sort(windows, {}, &TimeWindow::from);
  Duration covered{};
  std::optional<Timestamp> end;
  for (const auto& window : windows) {
    const auto from = std::max(window.from, end.value_or(window.from));
    covered.ns += std::max<std::int64_t>(0, (window.to - from).ns);
    end = std::max(end.value_or(window.to), window.to);
  }
  return covered.ns > 0 ? std::optional(covered) : std::nullopt;
}

// Of what user space told of runs there, else of anything, else the kernel.
std::optional<Duration> recorded_of(const Model& model, HostIndex host) {
  const auto is_of = [](Domain domain) {
    return [domain](const ChannelFacts& channel) { return channel.domain == domain; };
  };
  const auto has_callback_events = [](const ChannelFacts& channel) {
    return channel.domain == Domain::user && channel.has_callback_events;
  };
  if (const auto recorded = recorded_by(model, host, has_callback_events)) return recorded;
  if (const auto recorded = recorded_by(model, host, is_of(Domain::user))) return recorded;
  return recorded_by(model, host, is_of(Domain::kernel));
}

// When the kernel saw the main threads exit.
std::map<ProcessIndex, Timestamp> exits_of(const Model& model) {
  std::map<ProcessIndex, Timestamp> exits;
  for (const auto& thread : model.threads) {
    const bool is_main = thread.tid == model.processes[at(thread.process)].pid;
    if (is_main && thread.kernel_exit) exits.emplace(thread.process, thread.kernel_exit->time);
  }
  return exits;
}

TimeWindow life_of(const ProcessFacts& process, const std::optional<Timestamp>& exit) {
  TimeWindow life;
  if (process.run_begin && process.first_moment == RunMoment::start) {
    life.from = process.run_begin->time;
  } else if (process.start_ns) {
    life.from = Timestamp{*process.start_ns};
  }
  if (process.run_end) {
    life.to = process.run_end->at.time;
  } else if (exit) {
    life.to = *exit;
  }
  return life;
}

ThreadSchedReport report_of(const ThreadFacts& thread, const ReadBack& read_back) {
  return {.moment = read_back.moment,
          .policy = read_back.policy,
          .policy_name = std::string(policy_name(static_cast<Policy>(read_back.policy))),
          .flags = read_back.flags,
          .nice = read_back.nice,
          .priority = read_back.priority,
          .runtime_ns = read_back.runtime_ns,
          .deadline_ns = read_back.deadline_ns,
          .period_ns = read_back.period_ns,
          .cpus = read_back.cpus,
          .error = read_back.error,
          .slice_ns = asked_for(thread, read_back, &ReadBack::slice_ns),
          .util_min = asked_for(thread, read_back, &ReadBack::util_min),
          .util_max = asked_for(thread, read_back, &ReadBack::util_max)};
}

bool is_scheduled_alike(const ReadBack& a, const ReadBack& b) {
  return a.policy == b.policy && a.priority == b.priority && a.flags == b.flags &&
         a.runtime_ns == b.runtime_ns && a.deadline_ns == b.deadline_ns &&
         a.period_ns == b.period_ns && a.cpus == b.cpus;
}

// Those that were in force while callbacks started, the last one aside.
std::vector<ThreadSchedReport> former_of(const ThreadFacts& thread) {
  std::vector<const ReadBack*> all;
  all.reserve(thread.applied.size() + 3);
  for (const auto& applied : thread.applied)
    all.push_back(&applied);
  if (thread.first_audit) all.push_back(&*thread.first_audit);
  if (thread.audit_mismatch) all.push_back(&thread.audit_mismatch->second);
  if (thread.last_read_back) all.push_back(&*thread.last_read_back);
  std::ranges::sort(all, {},
                    [](const ReadBack* read) { return std::pair(read->n, read->at.time); });
  std::vector<ThreadSchedReport> former;
  for (std::size_t i = 0; i + 1 < all.size(); ++i) {
    const bool has_run = all[i + 1]->starts_before > all[i]->starts_before;
    if (has_run && !is_scheduled_alike(*all[i], *all.back()))
      former.push_back(report_of(thread, *all[i]));
  }
  return former;
}

ThreadReport report_of(const RuleContext& context, ThreadIndex index) {
  const auto& model = context.model;
  const auto& facts = model.threads[at(index)];
  ThreadReport report;
  report.index = index;
  report.process = facts.process;
  report.tid = facts.tid;
  report.name = facts.name;
  report.role = facts.role;
  const auto id_of = [&model](CallbackIndex callback) -> const std::string& {
    return model.callbacks[at(callback)].logical_id;
  };
  report.ran.reserve(facts.ran.size());
  for (const auto* pair : facts.ran)
    report.ran.push_back(pair->callback);
  std::ranges::stable_sort(report.ran, {}, id_of);
  report.callbacks.reserve(report.ran.size());
  for (const auto callback : report.ran)
    report.callbacks.push_back(id_of(callback));
  if (const auto& last = facts.last_read_back) {
    report.sched = report_of(facts, *last);
  } else if (const auto& all = facts.scheduled; !all.empty()) {
    const auto prio = all.back().first.prio;
    report.switched = {.prio = prio, .text = priority_text(prio), .changes = all.size() - 1};
  }
  if (const auto* applied = last_applied(model, facts)) report.applied = report_of(facts, *applied);
  report.former = former_of(facts);
  report.is_contradicted = facts.cpu_violation || facts.raised_priority || facts.lowered_priority;
  report.may_lack_read_backs = context.known.may_be_hidden(context.known.read_backs(index));
  report.busy_ns = facts.busy_ns;
  return report;
}

// Those that were announced or ran callbacks.
std::vector<ThreadIndex> threads_in_order(const Model& model) {
  std::vector<ThreadIndex> order;
  order.reserve(model.threads.size());
  for (std::size_t i = 0; i < model.threads.size(); ++i) {
    const auto& thread = model.threads[i];
    if (thread.announced || !thread.ran.empty())
      order.push_back(ThreadIndex{static_cast<std::uint32_t>(i)});
  }
  sort_rows(order, {}, [&model](ThreadIndex index) {
    const auto& thread = model.threads[at(index)];
    const auto& process = model.processes[at(thread.process)];
    return std::tuple(process.host, process.pid, thread.process, thread.tid);
  });
  return order;
}

std::vector<const MessageEdgeFacts*> edges_in_order(const Model& model) {
  const auto place_of = [&model](CallbackIndex index) {
    const auto& callback = model.callbacks[at(index)];
    return std::tuple(std::string_view(callback.logical_id),
                      model.processes[at(callback.process)].pid, index);
  };
  using Place = decltype(place_of(CallbackIndex{}));
  // Beside each edge what it is compared by, which lies far from the next one's.
  struct Row {
    Place to;
    std::optional<Place> from;
    const MessageEdgeFacts* edge = nullptr;
  };
  std::vector<Row> rows;
  rows.reserve(model.edges.size());
  for (const auto& edge : model.edges) {
    const auto from = edge.from ? std::optional(place_of(*edge.from)) : std::nullopt;
    rows.push_back({.to = place_of(edge.to), .from = from, .edge = &edge});
  }
  sort_rows(rows, {}, [](const Row& row) { return std::tie(row.to, row.from); });
  std::vector<const MessageEdgeFacts*> order;
  order.reserve(rows.size());
  for (const auto& row : rows)
    order.push_back(row.edge);
  return order;
}

GraphEdge report_of(const Model& model, const MessageEdgeFacts& facts) {
  GraphEdge edge;
  edge.from = facts.from;
  edge.to = facts.to;
  edge.topic = model.callbacks[at(facts.to)].source;
  edge.messages = facts.messages;
  if (facts.unrecorded > 0) edge.unrecorded = facts.unrecorded;
  edge.communication = facts.communication.summary();
  edge.publish_to_start = facts.handover.summary();
  if (facts.crosses) edge.clock_error = clock_error(model, *facts.crosses);
  return edge;
}

std::vector<HostReport> hosts_of(const Model& model) {
  std::vector<HostReport> hosts;
  hosts.reserve(model.hosts.size());
  const auto* reference = reference_host(model);
  for (std::size_t i = 0; i < model.hosts.size(); ++i) {
    const auto& host = model.hosts[i];
    hosts.push_back({.name = host.name,
                     .clock_offset_ns = host.clock_offset_ns,
                     .shift = clock_shift(host, *reference),
                     .recorded = recorded_of(model, HostIndex{static_cast<std::uint32_t>(i)})});
  }
  return hosts;
}

// Each pair once, in the order of its names.
std::vector<HostClockReport> clocks_of(const Model& model) {
  std::map<std::pair<std::string, std::string>, HostClockReport> pairs;
  std::set<std::pair<std::string, std::string>> changed;
  for (const auto& [from_to, facts] : model.host_clocks) {
    const auto& from = model.hosts[at(from_to.first)].name;
    const auto& to = model.hosts[at(from_to.second)].name;
    const bool is_there = from < to;
    auto& pair = pairs[std::minmax(from, to)];
    if (is_any_clock_set(model, from_to)) changed.insert(std::minmax(from, to));
    (is_there ? pair.messages_there : pair.messages_back) = facts.messages;
    (is_there ? pair.fastest_there_ns : pair.fastest_back_ns) = facts.shortest.ns;
  }
  std::vector<HostClockReport> reports;
  for (auto& [names, pair] : pairs) {
    std::tie(pair.first, pair.second) = names;
    if (pair.fastest_there_ns && pair.fastest_back_ns && !changed.contains(names)) {
      // Each is half the way, plus or minus what the clocks differ by.
      pair.ahead_ns = (*pair.fastest_there_ns - *pair.fastest_back_ns) / 2;
      pair.error_ns = (*pair.fastest_there_ns + *pair.fastest_back_ns) / 2;
    }
    reports.push_back(std::move(pair));
  }
  return reports;
}

// Processes whose subscriptions ran, and whether it is told of any which message it took.
std::map<ProcessIndex, bool> tell_messages(const Model& model) {
  std::map<ProcessIndex, bool> told;
  for (const auto& callback : model.callbacks) {
    if (callback.kind != CallbackKind::subscription || callback.instances == 0) continue;
    auto& is_told = told[callback.process];
    is_told = is_told || callback.messages_told > 0;
  }
  return told;
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

std::string_view label(Isolation isolation) noexcept {
  switch (isolation) {
    case Isolation::isolated:
      return "isolated";
    case Isolation::not_isolated:
      return "not_isolated";
    case Isolation::never_ran:
      break;
  }
  return "never_ran";
}

std::string_view label(ReleaseSource source) noexcept {
  switch (source) {
    case ReleaseSource::exact:
      return "exact";
    case ReleaseSource::timer_grid:
      return "timer_grid";
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

// Of each process, by topic.
std::map<ProcessIndex, std::map<std::string, std::uint64_t>> publications_of(const Model& model) {
  std::map<ProcessIndex, std::map<std::string, std::uint64_t>> published;
  for (const auto& publisher : model.publishers) {
    if (publisher.published.count == 0 || publisher.topic.empty()) continue;
    published[publisher.process][publisher.topic] += publisher.published.count;
  }
  return published;
}

// Of each process, by publisher.
std::map<ProcessIndex, std::vector<UnsentMessages>> unsent_of(const Model& model) {
  std::map<ProcessIndex, std::vector<UnsentMessages>> unsent;
  for (const auto& publisher : model.publishers) {
    if (publisher.unsent() == 0) continue;
    const auto node = std::ranges::find_if(model.nodes, [&publisher](const NodeFacts& facts) {
      return facts.process == publisher.process && facts.id == publisher.node;
    });
    unsent[publisher.process].push_back(
        {.node = node == model.nodes.end() ? std::string() : node->name,
         .topic = publisher.topic,
         .messages = publisher.unsent()});
  }
  return unsent;
}

Report build_report(const RuleContext& context, const VerdictReport& verdicts) {
  const auto& model = context.model;
  Report report;
  report.trace = summary_of(context, verdicts);
  report.defects = trace_defects(model, context.lives);
  report.hosts = hosts_of(model);

  const auto telling = tell_messages(model);
  const auto runs = verdicts_on_runs(verdicts);
  const auto exits = exits_of(model);
  auto published = publications_of(model);
  auto unsent = unsent_of(model);
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto& process = model.processes[i];
    if (!process.has_cie_events) continue;
    const ProcessIndex index{static_cast<std::uint32_t>(i)};
    ProcessReport entry{
        .index = index,
        .host = model.hosts[at(process.host)].name,
        .boot_id = process.boot_id,
        .pid_ns = process.pid_ns,
        .has_ended = process.run_end.has_value(),
        .lived =
            life_of(process, exits.contains(index) ? std::optional(exits.at(index)) : std::nullopt),
        .may_hide_callbacks = context.proof.unseen_callbacks(index).has_value(),
        .pid = process.pid,
        .program = context.names.program_of(index),
        .name = process.name,
        .executor = std::nullopt,
        .complete = is_complete(context, runs, index),
        .host_index = process.host,
        .traces = process.traces,
        .published = published[index]};
    if (const auto found = unsent.find(index); found != unsent.end())
      entry.unsent = std::move(found->second);
    if (!process.executor.empty()) entry.executor = process.executor;
    if (is_ros2_only(process)) {
      if (!process.tracetools.empty()) entry.tracetools = process.tracetools;
      const auto told = telling.find(index);
      if (told != telling.end()) entry.tells_messages = told->second;
    }
    report.processes.push_back(std::move(entry));
  }
  std::stable_sort(report.processes.begin(), report.processes.end(),
                   [](const auto& a, const auto& b) {
                     return std::tie(a.host, a.pid) < std::tie(b.host, b.pid);
                   });

  report.callbacks = callback_reports(context);
  const auto threads = threads_in_order(model);
  report.threads.reserve(threads.size());
  for (std::size_t i = 0; i < threads.size(); ++i) {
    if (i + 2 < threads.size()) prefetch_to_read(&model.threads[at(threads[i + 2])]);
    report.threads.push_back(report_of(context, threads[i]));
  }
  report.chains = chain_reports(model);
  report.clocks = clocks_of(model);
  report.recordings = recording_reports(model);
  const auto edges = edges_in_order(model);
  report.edges.reserve(edges.size());
  for (const auto* edge : edges)
    report.edges.push_back(report_of(model, *edge));
  return report;
}

}  // namespace cie::analysis
