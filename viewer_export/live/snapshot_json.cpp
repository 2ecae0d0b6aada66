#include "snapshot_json.hpp"

#include "json.hpp"

#include <stdexcept>

namespace cie::live {
namespace {

using analysis::Summary;
using analysis::Verdict;
using viewer_export::Json;
using viewer_export::optional_json;

constexpr const char* kSchema = "cie.live/1";

template <typename Range, typename Convert>
Json array_of(const Range& range, Convert convert) {
  Json result = Json::array();
  for (const auto& element : range)
    result.push_back(convert(element));
  return result;
}

template <typename T>
std::optional<T> optional_of(const Json& value) {
  return value.is_null() ? std::nullopt : std::optional<T>(value.get<T>());
}

template <typename T, typename Parse>
std::vector<T> list_of(const Json& array, Parse parse) {
  std::vector<T> result;
  result.reserve(array.size());
  for (const auto& element : array)
    result.push_back(parse(element));
  return result;
}

Json json_of(const std::optional<Summary>& s) {
  if (!s) return nullptr;
  return {{"count", s->count}, {"min", s->min},   {"max", s->max},
          {"sum", s->sum},     {"mean", s->mean}, {"p50", s->p50},
          {"p90", s->p90},     {"p99", s->p99},   {"p99_9", s->p99_9}};
}

std::optional<Summary> summary_of(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return Summary{.count = json.at("count"),
                 .min = json.at("min"),
                 .max = json.at("max"),
                 .sum = json.at("sum"),
                 .mean = json.at("mean"),
                 .p50 = json.at("p50"),
                 .p90 = json.at("p90"),
                 .p99 = json.at("p99"),
                 .p99_9 = json.at("p99_9")};
}

Verdict verdict_of(const Json& json) {
  const auto text = json.get<std::string>();
  for (const auto verdict :
       {Verdict::not_applicable, Verdict::pass, Verdict::inconclusive, Verdict::fail}) {
    if (analysis::label(verdict) == text) return verdict;
  }
  throw std::runtime_error("no verdict: " + text);
}

SourceState state_of(const Json& json) {
  const auto text = json.get<std::string>();
  for (const auto state : {SourceState::waiting, SourceState::streaming, SourceState::silent,
                           SourceState::lost, SourceState::ended}) {
    if (label(state) == text) return state;
  }
  throw std::runtime_error("no state: " + text);
}

Json json_of(const RecentInstance& i) {
  return {{"seq", i.seq},
          {"tid", i.tid},
          {"cpu", optional_json(i.cpu)},
          {"start_ns", i.start_ns},
          {"end_ns", i.end_ns},
          {"response_ns", i.response_ns},
          {"exact", i.is_exact},
          {"late", i.is_late},
          {"missed", i.missed},
          {"execution_ns", optional_json(i.execution_ns)}};
}

RecentInstance recent_of(const Json& json) {
  return {.seq = json.at("seq"),
          .tid = json.at("tid"),
          .cpu = optional_of<std::int32_t>(json.at("cpu")),
          .start_ns = json.at("start_ns"),
          .end_ns = json.at("end_ns"),
          .response_ns = json.at("response_ns"),
          .is_exact = json.at("exact"),
          .is_late = json.at("late"),
          .missed = json.at("missed"),
          .execution_ns = optional_of<std::int64_t>(json.at("execution_ns"))};
}

Json json_of(const CallbackView& c, bool with_recent) {
  Json json{{"index", c.index},
            {"host", c.host},
            {"pid", c.pid},
            {"logical_id", c.logical_id},
            {"kind", c.kind},
            {"tids", c.tids},
            {"isolated", c.is_isolated},
            {"ended", c.has_ended},
            {"deadline_ns", optional_json(c.deadline_ns)},
            {"exact", c.is_exact},
            {"window",
             {{"instances", c.instances},
              {"late", c.late},
              {"missed_releases", c.missed},
              {"response_time_ns", json_of(c.response)}}},
            {"total",
             {{"instances", c.total_instances},
              {"late", c.total_late},
              {"missed_releases", c.total_missed},
              {"response_time_ns", json_of(c.total_response)},
              {"response_time_counts", c.counts},
              {"response_time_sum_ns", c.response_sum_ns}}},
            {"last_response_ns", optional_json(c.last_response_ns)},
            {"last_end_ns", optional_json(c.last_end_ns)}};
  if (with_recent) {
    json["recent"] = array_of(c.recent, [](const RecentInstance& i) { return json_of(i); });
  }
  return json;
}

CallbackView callback_of(const Json& json) {
  const auto& window = json.at("window");
  const auto& total = json.at("total");
  CallbackView view{.index = json.at("index"),
                    .host = json.at("host"),
                    .pid = json.at("pid"),
                    .logical_id = json.at("logical_id"),
                    .kind = json.at("kind"),
                    .tids = json.at("tids"),
                    .is_isolated = json.at("isolated"),
                    .has_ended = json.at("ended"),
                    .deadline_ns = optional_of<std::int64_t>(json.at("deadline_ns")),
                    .instances = window.at("instances"),
                    .late = window.at("late"),
                    .missed = window.at("missed_releases"),
                    .response = summary_of(window.at("response_time_ns")),
                    .total_instances = total.at("instances"),
                    .total_late = total.at("late"),
                    .total_missed = total.at("missed_releases"),
                    .total_response = summary_of(total.at("response_time_ns")),
                    .is_exact = json.at("exact"),
                    .counts = total.at("response_time_counts"),
                    .response_sum_ns = total.at("response_time_sum_ns"),
                    .last_response_ns = optional_of<std::int64_t>(json.at("last_response_ns")),
                    .last_end_ns = optional_of<std::int64_t>(json.at("last_end_ns")),
                    .recent = {}};
  if (json.contains("recent")) {
    view.recent = list_of<RecentInstance>(json.at("recent"), recent_of);
  }
  return view;
}

Json json_of(const ThreadView& t) {
  return {{"host", t.host},
          {"pid", t.pid},
          {"tid", t.tid},
          {"name", t.name},
          {"role", t.role},
          {"callbacks", array_of(t.callbacks, [](const auto& id) { return Json(id); })},
          {"cpu_percent", optional_json(t.cpu_percent)}};
}

ThreadView thread_of(const Json& json) {
  return {.host = json.at("host"),
          .pid = json.at("pid"),
          .tid = json.at("tid"),
          .name = json.at("name"),
          .role = json.at("role"),
          .callbacks = json.at("callbacks"),
          .cpu_percent = optional_of<double>(json.at("cpu_percent"))};
}

Json json_of(const VerdictView& v) {
  return {{"rule", v.rule},         {"name", v.name},
          {"subject", v.subject},   {"verdict", analysis::label(v.verdict)},
          {"since_ns", v.since_ns}, {"note", v.note}};
}

VerdictView verdict_view_of(const Json& json) {
  return {.rule = json.at("rule"),
          .name = json.at("name"),
          .subject = json.at("subject"),
          .verdict = verdict_of(json.at("verdict")),
          .since_ns = json.at("since_ns"),
          .note = json.at("note")};
}

Json json_of(const VerdictChange& c) {
  return {{"time_ns", c.time_ns},
          {"rule", c.rule},
          {"name", c.name},
          {"subject", c.subject},
          {"from", analysis::label(c.from)},
          {"to", analysis::label(c.to)},
          {"note", c.note}};
}

VerdictChange change_of(const Json& json) {
  return {.time_ns = json.at("time_ns"),
          .rule = json.at("rule"),
          .name = json.at("name"),
          .subject = json.at("subject"),
          .from = verdict_of(json.at("from")),
          .to = verdict_of(json.at("to")),
          .note = json.at("note")};
}

Json json_of(const HostView& h) {
  return {{"host", h.host},
          {"session", h.session},
          {"state", label(h.state)},
          {"silent_ns", h.silent_ns},
          {"message", h.message}};
}

HostView host_of(const Json& json) {
  return {.host = json.at("host"),
          .session = json.at("session"),
          .state = state_of(json.at("state")),
          .silent_ns = json.at("silent_ns"),
          .message = json.at("message")};
}

Json json_of(const DefectView& d) {
  return {{"kind", d.kind}, {"severity", d.severity}, {"count", d.count}};
}

}  // namespace

std::string json_line(const Snapshot& s, bool with_recent) {
  const Json json{
      {"schema", kSchema},
      {"sequence", s.sequence},
      {"source", {{"url", s.source}, {"state", label(s.state)}, {"message", s.message}}},
      {"hosts", array_of(s.hosts, [](const HostView& h) { return json_of(h); })},
      {"time_ns", s.time_ns},
      {"realtime_ns", s.realtime_ns},
      {"window_ns", s.window_ns},
      {"events", s.events},
      {"events_per_second", s.events_per_second},
      {"delay_ns", optional_json(s.delay_ns)},
      {"lost_events", optional_json(s.lost_events)},
      {"lost_packets", s.lost_packets},
      {"defects", array_of(s.defects, [](const DefectView& d) { return json_of(d); })},
      {"callbacks",
       array_of(s.callbacks, [&](const CallbackView& c) { return json_of(c, with_recent); })},
      {"threads", array_of(s.threads, [](const ThreadView& t) { return json_of(t); })},
      {"verdict", analysis::label(s.verdict)},
      {"verdicts", array_of(s.verdicts, [](const VerdictView& v) { return json_of(v); })},
      {"verdicts_left_out", s.verdicts_left_out},
      {"changes", array_of(s.changes, [](const VerdictChange& c) { return json_of(c); })}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Snapshot parse_snapshot(std::string_view line) {
  try {
    const auto json = Json::parse(line);
    if (json.at("schema") != kSchema) throw std::runtime_error("not a line of cie.live/1");
    const auto& source = json.at("source");
    return {.sequence = json.at("sequence"),
            .state = state_of(source.at("state")),
            .source = source.at("url"),
            .message = source.at("message"),
            .hosts = list_of<HostView>(json.at("hosts"), host_of),
            .time_ns = json.at("time_ns"),
            .realtime_ns = json.at("realtime_ns"),
            .window_ns = json.at("window_ns"),
            .events = json.at("events"),
            .events_per_second = json.at("events_per_second"),
            .delay_ns = optional_of<std::int64_t>(json.at("delay_ns")),
            .lost_events = optional_of<std::uint64_t>(json.at("lost_events")),
            .lost_packets = json.at("lost_packets"),
            .verdict = verdict_of(json.at("verdict")),
            .defects = list_of<DefectView>(json.at("defects"),
                                           [](const Json& d) {
                                             return DefectView{.kind = d.at("kind"),
                                                               .severity = d.at("severity"),
                                                               .count = d.at("count")};
                                           }),
            .callbacks = list_of<CallbackView>(json.at("callbacks"), callback_of),
            .threads = list_of<ThreadView>(json.at("threads"), thread_of),
            .verdicts = list_of<VerdictView>(json.at("verdicts"), verdict_view_of),
            .verdicts_left_out = json.at("verdicts_left_out"),
            .changes = list_of<VerdictChange>(json.at("changes"), change_of)};
  } catch (const Json::exception& error) {
    throw std::runtime_error(std::string("not a line of cie.live/1: ") + error.what());
  }
}

}  // namespace cie::live
