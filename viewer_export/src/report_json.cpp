#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/version.hpp>

#include "json.hpp"

#include <string>

namespace cie::viewer_export {
namespace {

using analysis::Summary;

Json json_of(const Summary& s) {
  return {{"count", s.count}, {"min", s.min}, {"max", s.max}, {"sum", s.sum},
          {"mean", s.mean},  // a NaN would be written as null
          {"p50", s.p50},     {"p90", s.p90}, {"p99", s.p99}, {"p99_9", s.p99_9}};
}
Json json_of(const std::optional<Summary>& s) { return s ? json_of(*s) : Json(nullptr); }
Json json_of(const std::optional<analysis::Timestamp>& t) {
  return t ? Json(t->ns) : Json(nullptr);
}

// Arrays need saying so: braces around strings would make an object of two of them.
template <typename Range, typename Convert>
Json array_of(const Range& range, Convert convert) {
  Json result = Json::array();
  for (const auto& element : range) {
    result.push_back(convert(element));
  }
  return result;
}
template <typename Range>
Json array_of(const Range& range) {
  return array_of(range, [](const auto& element) { return Json(element); });
}

Json json_of(const analysis::TraceSummary& trace) {
  return {{"paths", array_of(trace.paths)},
          {"begin_ns", json_of(trace.begin)},
          {"end_ns", json_of(trace.end)},
          {"events", trace.events},
          {"streams", trace.streams},
          {"hosts", array_of(trace.hosts)},
          {"lost_events", optional_json(trace.lost_events)},
          {"complete", trace.complete}};
}

Json json_of(const analysis::TraceDefect& defect) {
  return {{"kind", defect.kind},
          {"severity", analysis::label(defect.severity)},
          {"count", defect.count},
          {"advice", defect.advice}};
}

Json json_of(const analysis::ProcessReport& process) {
  return {{"host", process.host},
          {"pid", process.pid},
          {"name", process.name},
          {"executor", optional_json(process.executor)},
          {"complete", process.complete}};
}

Json json_of(const analysis::CallbackThread& thread) {
  return {{"tid", thread.tid}, {"name", thread.name}, {"instances", thread.instances}};
}

Json json_of(const analysis::CallbackReport& c) {
  return {{"logical_id", c.logical_id},
          {"pid", c.pid},
          {"node", c.node},
          {"kind", c.kind},
          {"source", c.source},
          {"symbol", c.symbol},
          {"period_ns", optional_json(c.period_ns)},
          {"group", optional_json(c.group)},
          {"threads", array_of(c.threads, [](const auto& thread) { return json_of(thread); })},
          {"isolated", c.isolated},
          {"instances", c.instances},
          {"incomplete", c.incomplete},
          {"missed_releases", optional_json(c.missed_releases)},
          {"release_source",
           c.release_source ? Json(analysis::label(*c.release_source)) : Json(nullptr)},
          {"response_time_ns", json_of(c.response_time)},
          {"response_time_lower_ns", json_of(c.response_time_lower)},
          {"response_time_upper_ns", json_of(c.response_time_upper)},
          {"start_latency_ns", json_of(c.start_latency)},
          {"duration_ns", json_of(c.duration)},
          {"inter_arrival_ns", json_of(c.inter_arrival)},
          {"execution_time_ns", json_of(c.execution_time)},
          {"preempted_ns", json_of(c.preempted)},
          {"blocked_ns", json_of(c.blocked)},
          {"wake_delay_ns", json_of(c.wake_delay)},
          {"wakeup_latency_ns", json_of(c.wakeup_latency)}};
}

Json json_of(const analysis::ThreadSchedReport& s) {
  return {{"moment", s.moment},
          {"policy", s.policy},
          {"policy_name", s.policy_name},
          {"flags", s.flags},
          {"nice", s.nice},
          {"priority", s.priority},
          {"runtime_ns", s.runtime_ns},
          {"deadline_ns", s.deadline_ns},
          {"period_ns", s.period_ns},
          {"cpus", array_of(s.cpus)},
          {"error", s.error},
          {"slice_ns", optional_json(s.slice_ns)},
          {"util_min", optional_json(s.util_min)},
          {"util_max", optional_json(s.util_max)}};
}

Json json_of(const analysis::ThreadReport& thread) {
  return {{"pid", thread.pid},
          {"tid", thread.tid},
          {"name", thread.name},
          {"role", optional_json(thread.role)},
          {"callbacks", array_of(thread.callbacks)},
          {"sched", thread.sched ? json_of(*thread.sched) : Json(nullptr)},
          {"busy_ns", optional_json(thread.busy_ns)}};
}

// A key that only what passes between hosts has.
void add_clock_error(Json& object, const std::optional<analysis::ClockError>& error) {
  if (!error) return;
  const auto bound = [](const auto& value) { return value ? Json(value->ns) : Json(nullptr); };
  object["clock_error_ns"] = {{"min", bound(error->least)}, {"max", bound(error->most)}};
}

Json json_of(const analysis::HostClockReport& pair) {
  const auto either = [](const auto& there, const auto& back) {
    return Json::array({optional_json(there), optional_json(back)});
  };
  return {{"hosts", Json::array({pair.first, pair.second})},
          {"messages", Json::array({pair.messages_there, pair.messages_back})},
          {"fastest_ns", either(pair.fastest_there_ns, pair.fastest_back_ns)},
          {"ahead_ns", optional_json(pair.ahead_ns)},
          {"error_ns", optional_json(pair.error_ns)}};
}

Json json_of(const analysis::HopReport& hop) {
  Json json{{"from", hop.from},
            {"to", optional_json(hop.to)},
            {"processing_ns", json_of(hop.processing)},
            {"communication_ns", json_of(hop.communication)}};
  add_clock_error(json, hop.clock_error);
  return json;
}

Json json_of(const analysis::ChainReport& chain) {
  Json json{{"name", chain.name},
            {"pid", optional_json(chain.pid)},
            {"hops", array_of(chain.hops)},
            {"instances", chain.instances},
            {"path_latency_ns", json_of(chain.path_latency)},
            {"reaction_time_ns", json_of(chain.reaction_time)},
            {"data_age_ns", json_of(chain.data_age)},
            {"hop_table", array_of(chain.hop_table, [](const auto& hop) { return json_of(hop); })}};
  add_clock_error(json, chain.clock_error);
  return json;
}

}  // namespace

void write_report_json(std::ostream& out, const analysis::Report& report) {
  const auto convert = [](const auto& element) { return json_of(element); };
  // Pids of several hosts may be the same.
  const auto with_host = [&report](const auto& element) {
    auto json = json_of(element);
    if (report.trace.hosts.size() > 1) json["host"] = element.host;
    return json;
  };
  Json json{{"schema", "cie.report/1"},
            {"tool", {{"name", "cie"}, {"version", tool_version()}}},
            {"trace", json_of(report.trace)},
            {"defects", array_of(report.defects, convert)},
            {"processes", array_of(report.processes, convert)},
            {"callbacks", array_of(report.callbacks, with_host)},
            {"threads", array_of(report.threads, with_host)},
            {"chains", array_of(report.chains, convert)}};
  if (!report.clocks.empty()) json["clocks"] = array_of(report.clocks, convert);
  write_json(out, json);
}

}  // namespace cie::viewer_export
