// The fields of a snapshot, each named once, in the order of the document: see
// cie/analysis/report_fields.hpp.
#pragma once

#include <cie/analysis/report_fields.hpp>
#include <cie/tracepoints/fields.hpp>

#include "snapshot.hpp"

namespace cie::live {

void fields(auto& visit, Is<RecentInstance> auto& i) {
  visit("seq", i.seq);
  visit("tid", i.tid);
  visit("cpu", i.cpu);
  visit("start_ns", i.start_ns);
  visit("end_ns", i.end_ns);
  visit("response_ns", i.response_ns);
  visit("exact", i.is_exact);
  visit("late", i.is_late);
  visit("missed", i.missed);
  visit("execution_ns", i.execution_ns);
}

void fields(auto& visit, Is<CallbackView> auto& c) {
  visit("index", c.index);
  visit("host", c.host);
  visit("pid", c.pid);
  visit("logical_id", c.logical_id);
  visit("name", c.name);
  visit("kind", c.kind);
  visit("tids", c.tids);
  visit.derived("isolated", c.isolation == analysis::Isolation::isolated);
  visit("isolation", c.isolation);
  visit("ended", c.has_ended);
  visit("deadline_ns", c.deadline_ns);
  visit("deadline_of_spec", c.is_deadline_of_spec);
  visit("period_ns", c.period_ns);
  visit("exact", c.is_exact);
  visit.object("window", [&c](auto& window) {
    window("instances", c.instances);
    window("late", c.late);
    window("missed_releases", c.missed);
    window("response_time_ns", c.response);
  });
  visit.object("total", [&c](auto& total) {
    total("instances", c.total_instances);
    total("late", c.total_late);
    total("missed_releases", c.total_missed);
    total("missed_too_many", c.is_missing_too_many);
    total("response_time_ns", c.total_response);
    total("response_time_counts", c.counts);
    total("response_time_sum_ns", c.response_sum_ns);
  });
  visit.object("open", [&c](auto& open) {
    open("longest_ns", c.open_ns);
    open("late", c.open_late);
    open("long", c.is_open_long);
    open("certain", c.is_open_certain);
  });
  visit("last_response_ns", c.last_response_ns);
  visit("last_end_ns", c.last_end_ns);
  visit.detail("recent", c.recent);
}

void fields(auto& visit, Is<ThreadView> auto& t) {
  visit("index", t.index);
  visit("host", t.host);
  visit("pid", t.pid);
  visit("tid", t.tid);
  visit("name", t.name);
  visit("role", t.role);
  visit("callbacks", t.callbacks);
  visit("cpu_percent", t.cpu_percent);
}

void fields(auto& visit, Is<VerdictView> auto& v) {
  visit("rule", v.rule);
  visit("name", v.name);
  visit("subject", v.subject);
  visit("kind", v.about.kind);
  visit("index", v.about.index);
  visit("verdict", v.verdict);
  visit("since_ns", v.since_ns);
  visit("note", v.note);
  visit("says", v.says);
}

void fields(auto& visit, Is<RuleViolations> auto& v) {
  visit("rule", v.rule);
  visit("name", v.name);
  visit("subjects", v.subjects);
}

void fields(auto& visit, Is<VerdictChange> auto& c) {
  visit("time_ns", c.time_ns);
  visit("rule", c.rule);
  visit("name", c.name);
  visit("subject", c.subject);
  visit("kind", c.about.kind);
  visit("index", c.about.index);
  visit("from", c.from);
  visit("to", c.to);
  visit("note", c.note);
  visit("says", c.says);
}

void fields(auto& visit, Is<HostView> auto& h) {
  visit("host", h.host);
  visit("session", h.session);
  visit("state", h.state);
  visit("silent_ns", h.silent_ns);
  visit("message", h.message);
}

void fields(auto& visit, Is<DefectView> auto& d) {
  visit("kind", d.kind);
  visit("severity", d.severity);
  visit("count", d.count);
}

void fields(auto& visit, Is<Snapshot> auto& s) {
  visit("sequence", s.sequence);
  visit.object("source", [&s](auto& source) {
    source("url", s.source);
    source("watched", s.watched);
    source("state", s.state);
    source("message", s.message);
  });
  visit("hosts", s.hosts);
  visit("time_ns", s.time_ns);
  visit("realtime_ns", s.realtime_ns);
  visit("window_ns", s.window_ns);
  visit("events", s.events);
  visit("events_per_second", s.events_per_second);
  visit("delay_ns", s.delay_ns);
  visit("lost_events", s.lost_events);
  visit("lost_packets", s.lost_packets);
  visit("defects", s.defects);
  visit("callbacks", s.callbacks);
  visit("threads", s.threads);
  visit("verdict", s.verdict);
  visit("violations", s.violations);
  visit("verdicts", s.verdicts);
  visit("verdicts_left_out", s.verdicts_left_out);
  visit("changes", s.changes);
}

}  // namespace cie::live
