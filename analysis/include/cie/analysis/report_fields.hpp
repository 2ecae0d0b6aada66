// The fields of a report, each named once, in the order of the JSON: fields() shows those of a row
// to whoever writes or reads rows. Such a visitor has
//
//   visit(name, value)        a field of the row, in itself a row perhaps, or a list of rows
//   visit.added(name, value)  likewise, of a later version: tables have it behind the others, and
//                             older documents lack it
//   visit.first(name, value, most)  likewise, a list of which documents have the first rows
//   visit.present(name, optional)  one that a document has only where there is something to tell
//   visit.word(name, optional)     an enumerator by its label; empty text where it is not known
//   visit.number(name, index)      of a row: a meaning in its document alone
//   visit.derived(name, value)     what follows from other fields
//   visit.detail(name, value)      that a document has only for whoever asks for details
//   visit.object(name, visit_its)  an object whose members are fields of the row
//   visit.sentence(name, note)      what evidence shows: its sentence, code and arguments
//   visit.pid(name, process) and visit.host(name, process)  what the process's row says
//   visit.pair(name, a, b)         two fields that are told as a list
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/fields.hpp>

namespace cie::analysis {

void fields(auto& visit, Is<Summary> auto& s) {
  visit("count", s.count);
  visit("min", s.min);
  visit("max", s.max);
  visit("sum", s.sum);
  visit("mean", s.mean);
  visit("p50", s.p50);
  visit("p90", s.p90);
  visit("p99", s.p99);
  visit("p99_9", s.p99_9);
}

void fields(auto& visit, Is<TraceSummary> auto& t) {
  visit("paths", t.paths);
  visit("begin_ns", t.begin);
  visit("end_ns", t.end);
  visit("events", t.events);
  visit("streams", t.streams);
  visit("hosts", t.hosts);
  visit("lost_events", t.lost_events);
  visit("complete", t.complete);
  visit.added("clock_offset_ns", t.clock_offset_ns);
}

void fields(auto& visit, Is<OutsideWindow> auto& o) {
  visit("instances", o.instances);
  visit("ns", o.length);
}

void fields(auto& visit, Is<TraceDefect> auto& d) {
  visit("kind", d.kind);
  visit("severity", d.severity);
  visit("count", d.count);
  visit("advice", d.advice);
}

void fields(auto& visit, Is<UnsentMessages> auto& u) {
  visit("node", u.node);
  visit("topic", u.topic);
  visit("messages", u.messages);
}

void fields(auto& visit, Is<ProcessReport> auto& p) {
  visit("host", p.host);
  visit("pid", p.pid);
  visit("name", p.name);
  visit("executor", p.executor);
  visit("complete", p.complete);
  visit.number("index", p.index);
  visit.present("tracetools", p.tracetools);
  visit.present("tells_messages", p.tells_messages);
  visit.present("unsent", p.unsent);
}

void fields(auto& visit, Is<CallbackThread> auto& t) {
  visit("tid", t.tid);
  visit("name", t.name);
  visit("instances", t.instances);
  visit.number("thread", t.thread);
}

void fields(auto& visit, Is<Preemptor> auto& p) {
  visit("tid", p.tid);
  visit("name", p.name);
  visit("ns", p.time);
}

// The quantities of a callback, by the names of their fields.
void quantities(auto& visit, Is<CallbackReport> auto& c) {
  visit("response_time_ns", c.response_time);
  visit("response_time_lower_ns", c.response_time_lower);
  visit("response_time_upper_ns", c.response_time_upper);
  visit("start_latency_ns", c.start_latency);
  visit("duration_ns", c.duration);
  visit("inter_arrival_ns", c.inter_arrival);
  visit("execution_time_ns", c.execution_time);
  visit("preempted_ns", c.preempted);
  visit("blocked_ns", c.blocked);
  visit("wake_delay_ns", c.wake_delay);
  visit("wakeup_latency_ns", c.wakeup_latency);
}

// In a document there are many callbacks, and of each most others were preempted by for moments.
inline constexpr std::size_t kMostPreemptorsTold = 16;

void fields(auto& visit, Is<CallbackReport> auto& c) {
  visit("logical_id", c.logical_id);
  visit.pid("pid", c.process);
  visit("node", c.node);
  visit.word("kind", c.kind);
  visit("source", c.source);
  visit("symbol", c.symbol);
  visit("period_ns", c.period_ns);
  visit("group", c.group);
  visit("threads", c.threads);
  visit.derived("isolated", c.is_isolated());
  visit("instances", c.instances);
  visit("incomplete", c.incomplete);
  visit.added("exceptions", c.exceptions);
  visit("missed_releases", c.missed_releases);
  visit.added("longest_queue", c.longest_queue);
  visit("release_source", c.release_source);
  quantities(visit, c);
  visit.added("isolation", c.isolation);
  visit.number("index", c.index);
  visit.number("process", c.process);
  visit.host("host", c.process);
  visit.added("deadline_ns", c.deadline_ns);
  visit.added("response_deadline_ns", c.response_deadline);
  visit.added("late", c.late);
  visit.first("preempted_by", c.preempted_by, kMostPreemptorsTold);
  visit.added("cut", c.cut);
  visit.added("runs_not_seen", c.runs_not_seen);
  visit.present("outside_window", c.outside_window);
  visit.added("lost_samples", c.lost_samples);
  visit.added("overwritten_samples", c.overwritten_samples);
  visit.present("overwritten_at_least", c.is_overwritten_at_least);
  visit.present("lost_samples_before", c.lost_before);
  visit.present("overwritten_samples_before", c.overwritten_before);
  visit.present("response_time_at_least_ns", c.response_time_at_least);
  visit.present("median_known", c.is_median_known);
  visit.present("late_open", c.late_open);
}

void fields(auto& visit, Is<ThreadSchedReport> auto& s) {
  visit.word("moment", s.moment);
  visit("policy", s.policy);
  visit("policy_name", s.policy_name);
  visit("flags", s.flags);
  visit("nice", s.nice);
  visit("priority", s.priority);
  visit("runtime_ns", s.runtime_ns);
  visit("deadline_ns", s.deadline_ns);
  visit("period_ns", s.period_ns);
  visit("cpus", s.cpus);
  visit("error", s.error);
  visit.added("slice_ns", s.slice_ns);
  visit.added("util_min", s.util_min);
  visit.added("util_max", s.util_max);
}

void fields(auto& visit, Is<ThreadSwitchedReport> auto& s) {
  visit("prio", s.prio);
  visit("text", s.text);
  visit("changes", s.changes);
}

void fields(auto& visit, Is<ThreadReport> auto& t) {
  visit.pid("pid", t.process);
  visit("tid", t.tid);
  visit("name", t.name);
  visit("role", t.role);
  visit("callbacks", t.callbacks);
  visit("sched", t.sched);
  visit.present("switched", t.switched);
  visit("busy_ns", t.busy_ns);
  visit.number("index", t.index);
  visit.number("process", t.process);
  visit.number("ran", t.ran);
  visit.host("host", t.process);
}

// Only what passes between hosts has one.
void fields(auto& visit, Is<ClockError> auto& e) {
  visit("min", e.least);
  visit("max", e.most);
}

void fields(auto& visit, Is<HostClockReport> auto& c) {
  visit.pair("hosts", c.first, c.second);
  visit.pair("messages", c.messages_there, c.messages_back);
  visit.pair("fastest_ns", c.fastest_there_ns, c.fastest_back_ns);
  visit("ahead_ns", c.ahead_ns);
  visit("error_ns", c.error_ns);
}

void fields(auto& visit, Is<HopReport> auto& h) {
  visit("from", h.from);
  visit("to", h.to);
  visit("processing_ns", h.processing);
  visit("communication_ns", h.communication);
  visit.number("from_callback", h.from_callback);
  visit.number("to_callback", h.to_callback);
  visit.present("clock_error_ns", h.clock_error);
  visit.present("start_to_publish_ns", h.start_to_publish);
  visit.present("publish_to_start_ns", h.publish_to_start);
}

void fields(auto& visit, Is<ChainReport> auto& c) {
  visit("name", c.name);
  visit.pid("pid", c.process);
  visit("hops", c.hops);
  visit("instances", c.instances);
  visit("path_latency_ns", c.path_latency);
  visit("reaction_time_ns", c.reaction_time);
  visit("data_age_ns", c.data_age);
  visit("hop_table", c.hop_table);
  visit.number("process", c.process);
  visit.number("callbacks", c.callbacks);
  visit.number("index", c.index);
  visit.present("undivided_ns", c.undivided);
  visit.present("from_start_ns", c.from_start);
  visit.present("path_latency_upper_ns", c.path_latency_upper);
  visit.present("response_ns", c.response);
  visit.present("clock_error_ns", c.clock_error);
}

void fields(auto& visit, Is<GraphEdge> auto& e) {
  visit.number("from", e.from);
  visit.number("to", e.to);
  visit("topic", e.topic);
  visit("messages", e.messages);
  visit("communication_ns", e.communication);
  visit.present("unrecorded", e.unrecorded);
  visit.present("clock_error_ns", e.clock_error);
  visit.present("publish_to_start_ns", e.publish_to_start);
}

void fields(auto& visit, Is<TakenMessages> auto& t) {
  visit("messages", t.messages);
  visit("unrecorded", t.unrecorded);
}

void fields(auto& visit, Is<RecordingReport> auto& r) {
  visit("path", r.path);
  visit("host", r.host);
  visit("command", r.command);
  visit("exit", r.exit);
  visit("kernel_events", r.has_kernel_events);
  visit("first_chunk", r.first_chunk);
  visit("begin_ns", r.begin.monotonic_ns);
  visit("problems", r.problems);
}

}  // namespace cie::analysis
