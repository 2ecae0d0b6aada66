#include "snapshot_json.hpp"

#include <cie/analysis/report_fields.hpp>

#include "json/json.hpp"

#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::live {
namespace {

using analysis::Is;
using analysis::Isolation;
using analysis::Verdict;
using viewer_export::Json;

constexpr const char* kSchema = "cie.live/1";

// Each type's fields are named once, in the order of the document: fields() shows them to a Writer
// or a Reader, which calls it again for what has fields itself.
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
  visit.derived("isolated", c.isolation == Isolation::isolated);
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
  visit("last_response_ns", c.last_response_ns);
  visit("last_end_ns", c.last_end_ns);
  visit.recent("recent", c.recent);
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

template <typename T>
concept HasFields = requires(T& value, int visit) {
  fields(visit, value);
};

class Writer {
 public:
  Writer(Json& json, bool with_recent) : json_(json), with_recent_(with_recent) {}

  template <typename T>
  void operator()(const char* name, const T& value) {
    json_[name] = json_of(value);
  }
  template <typename Visit>
  void object(const char* name, const Visit& visit) {
    Writer inner(json_[name], with_recent_);
    visit(inner);
  }
  // What follows from another field.
  void derived(const char* name, bool value) { json_[name] = value; }
  void recent(const char* name, const std::vector<RecentInstance>& instances) {
    if (with_recent_) (*this)(name, instances);
  }

 private:
  template <typename T>
  Json json_of(const T& value) const {
    if constexpr (HasFields<const T>) {
      Json json;
      Writer inner(json, with_recent_);
      fields(inner, value);
      return json;
    } else {
      return value;
    }
  }
  Json json_of(Verdict verdict) const { return analysis::label(verdict); }
  Json json_of(analysis::SubjectKind kind) const { return analysis::label(kind); }
  Json json_of(SourceState state) const { return label(state); }
  Json json_of(Isolation isolation) const { return analysis::label(isolation); }
  template <typename T>
  Json json_of(const std::optional<T>& value) const {
    return value ? json_of(*value) : Json(nullptr);
  }
  template <typename T>
  Json json_of(const std::vector<T>& values) const {
    Json json = Json::array();
    for (const auto& value : values)
      json.push_back(json_of(value));
    return json;
  }

  Json& json_;
  bool with_recent_;
};

// One of `all` that is called so.
template <typename Enum>
Enum labelled(const Json& json, std::initializer_list<Enum> all) {
  const auto text = json.get<std::string>();
  for (const auto value : all) {
    if (label(value) == text) return value;
  }
  throw std::runtime_error("not a line of cie.live/1: what is " + text + '?');
}

class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {}

  template <typename T>
  void operator()(const char* name, T& value) {
    read(json_.at(name), value);
  }
  template <typename Visit>
  void object(const char* name, const Visit& visit) {
    Reader inner(json_.at(name));
    visit(inner);
  }
  void derived(const char* /*name*/, bool /*value*/) {}
  void recent(const char* name, std::vector<RecentInstance>& instances) {
    if (json_.contains(name)) (*this)(name, instances);
  }

 private:
  template <typename T>
  static void read(const Json& json, T& value) {
    if constexpr (HasFields<T>) {
      Reader inner(json);
      fields(inner, value);
    } else {
      json.get_to(value);
    }
  }
  static void read(const Json& json, Verdict& verdict) {
    verdict = labelled(
        json, {Verdict::not_applicable, Verdict::pass, Verdict::inconclusive, Verdict::fail});
  }
  static void read(const Json& json, analysis::SubjectKind& kind) {
    using enum analysis::SubjectKind;
    kind = labelled(json, {trace, process, thread, callback, group, topic, chain});
  }
  static void read(const Json& json, Isolation& isolation) {
    isolation =
        labelled(json, {Isolation::isolated, Isolation::not_isolated, Isolation::never_ran});
  }
  static void read(const Json& json, SourceState& state) {
    state = labelled(json, {SourceState::waiting, SourceState::streaming, SourceState::silent,
                            SourceState::lost, SourceState::ended});
  }
  template <typename T>
  static void read(const Json& json, std::optional<T>& value) {
    value.reset();
    if (json.is_null()) return;
    T known;
    read(json, known);
    value = std::move(known);
  }
  template <typename T>
  static void read(const Json& json, std::vector<T>& values) {
    values.clear();
    for (const auto& element : json)
      read(element, values.emplace_back());
  }

  const Json& json_;
};

}  // namespace

std::string json_line(const Snapshot& snapshot, bool with_recent) {
  Json json{{"schema", kSchema}};
  Writer writer(json, with_recent);
  fields(writer, snapshot);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Snapshot parse_snapshot(std::string_view line) {
  try {
    const auto json = Json::parse(line);
    if (json.at("schema") != kSchema) throw std::runtime_error("not a line of cie.live/1");
    Snapshot snapshot;
    Reader reader(json);
    fields(reader, snapshot);
    return snapshot;
  } catch (const Json::exception& error) {
    throw std::runtime_error(std::string("not a line of cie.live/1: ") + error.what());
  }
}

}  // namespace cie::live
