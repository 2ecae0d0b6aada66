#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/html_report.hpp>

#include "html_files.hpp"
#include "json/documents.hpp"
#include "json/json.hpp"
#include "output/base64.hpp"
#include "output/binary_numbers.hpp"
#include "output/gzip_stream.hpp"
#include "page_names.hpp"
#include "text/callback_ranking.hpp"
#include "text/headline.hpp"
#include "text/report_head.hpp"
#include "text/xml.hpp"
#include "timelines/common_clock.hpp"
#include "timelines/timeline_choice.hpp"
#include "words/idle_words.hpp"
#include "words/recording_words.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace cie::viewer_export {
namespace {

// Of several open pages each is told by its recording.
std::string title_of(const analysis::Report& report) {
  const auto name = name_of_recording(report);
  return name.empty() ? "cie report" : name + ": cie report";
}

// The timeline's columns are varints, lane after lane, column after column.

// Zero for what is not known.
void put_optional(std::string& out, const std::optional<std::int64_t>& value) {
  append_varint(out, value ? zigzag(*value) + 1 : 0);
}

template <typename Get>
void put_column(std::string& out, const std::vector<KeptInstance>& instances, Get get) {
  for (const KeptInstance& instance : instances)
    put_optional(out, get(instance));
}

// `base`: what starts are relative to, by the lane's own clock.
void put_lane(std::string& out, const std::vector<KeptInstance>& instances, std::int64_t base,
              const std::vector<std::int64_t>& tids) {
  std::int64_t before = base;
  for (const KeptInstance& i : instances)
    append_varint(out, zigzag(i.start - std::exchange(before, i.start)));
  put_column(out, instances, [](const KeptInstance& i) { return i.least_start_latency(); });
  put_column(out, instances, [](const KeptInstance& i) -> std::optional<std::int64_t> {
    if (!i.numbers.is_known(KeptInstance::end)) return std::nullopt;
    return i.numbers.value(KeptInstance::end) - i.start;
  });
  for (const auto part : {KeptInstance::execution, KeptInstance::preempted, KeptInstance::blocked,
                          KeptInstance::wake_delay}) {
    put_column(out, instances, [part](const KeptInstance& i) { return i.number(part); });
  }
  std::int64_t seq_before = 0;
  for (const KeptInstance& i : instances) {
    const auto seq = static_cast<std::int64_t>(i.seq);
    append_varint(out, zigzag(seq - std::exchange(seq_before, seq)));
  }
  for (const KeptInstance& i : instances) {
    const auto place = std::ranges::lower_bound(tids, i.tid) - tids.begin();
    append_varint(out,
                  static_cast<std::uint64_t>(place) << 1U | (is_known(i.release_source) ? 1U : 0U));
  }
}

// JSON within a script element: nothing in it may look like the element's end.
std::string script_data(std::string_view json) {
  std::string text;
  text.reserve(json.size());
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text;
}

Json histograms_json(const analysis::Report& report) {
  Json histograms = Json::array();
  for (const analysis::CallbackReport& callback : report.callbacks) {
    Json buckets = Json::array();
    if (callback.response_time) {
      for (const auto& bucket : callback.response_time->buckets)
        buckets.push_back(Json::array({bucket.value, bucket.count}));
    }
    histograms.push_back(std::move(buckets));
  }
  return histograms;
}

// The row of the callback that the text report has first; null where no response time is known.
Json worst_row(const analysis::Report& report) {
  for (const auto* callback : worst_first(report)) {
    if (analysis::longest_response(*callback)) return callback - report.callbacks.data();
  }
  return nullptr;
}

// By callback: why its CPU was idle while it was runnable, where it was.
Json idle_json(const Judged& judged) {
  std::map<std::string, std::string> reasons;
  for (const auto& callback : judged.report.callbacks) {
    if (idle_time(callback.preempted_by).ns <= 0) continue;
    reasons[std::to_string(analysis::at(callback.index))] = why_cpu_was_idle(judged.rows, callback);
  }
  return object_json(reasons);
}

// As the text report's first lines.
Json head_json(const analysis::AnalysisResult& result, const ReportContext& context) {
  const TextStyle style{.unicode = true};
  const Judged judged(result.verdicts, result.report, context.verify, style);
  const auto head = report_head(judged, context);
  const Headline headline(judged, head.findings, style);
  const auto fact = head.has_verdict() ? headline.fact() : head.isolation;
  const bool is_told = fact.find(head.isolation) != std::string::npos;
  Json accused = Json::array();
  for (const auto& finding : head.findings)
    accused.push_back(finding.rule->id);
  Json remedies = Json::object();
  for (const auto& finding : findings_of(judged)) {
    if (auto remedy = remedy_of(judged, finding); !remedy.empty())
      remedies[finding.rule->id] = std::move(remedy);
  }
  return {
      {"claimed", head.is_isolation_claimed},
      {"accused", std::move(accused)},
      {"remedies", std::move(remedies)},
      {"idle", idle_json(judged)},
      {"worst", worst_row(result.report)},
      {"verdict", head.has_verdict() ? Json(analysis::label(headline.verdict())) : Json(nullptr)},
      {"fact", fact},
      {"isolation", is_told ? Json(nullptr) : Json(head.isolation)}};
}

}  // namespace

struct HtmlReport::State {
  explicit State(std::size_t max_timeline) : choice(max_timeline) {}

  static Json lanes_json(const analysis::Report& report,
                         const std::vector<TimelineChoice::Kept>& kept, std::string& columns);

  TimelineChoice choice;
};

HtmlReport::HtmlReport(std::size_t max_timeline) : state_(std::make_unique<State>(max_timeline)) {}
HtmlReport::~HtmlReport() = default;

void HtmlReport::on_instance(const analysis::Instance& instance) {
  state_->choice.add(KeptInstance::of(instance));
}

Json HtmlReport::State::lanes_json(const analysis::Report& report,
                                   const std::vector<TimelineChoice::Kept>& kept,
                                   std::string& columns) {
  const CommonClock clock(report);
  const analysis::ReportRows rows(report);
  const auto host_of = [&rows](const TimelineChoice::Kept& lane) {
    const auto* process = rows.find(lane.instances.front().process);
    return process == nullptr ? analysis::HostIndex{} : process->host_index;
  };
  std::optional<std::int64_t> first;
  for (const auto& lane : kept) {
    if (lane.instances.empty()) continue;
    const auto start = clock.of(host_of(lane), lane.instances.front().start);
    first = std::min(first.value_or(start), start);
  }
  const auto base = first.value_or(0);
  Json lanes = Json::array();
  for (std::size_t number = 0; number < kept.size(); ++number) {
    const auto& lane = kept[number];
    if (lane.instances.empty()) continue;
    const auto* row = rows.find(analysis::CallbackIndex{static_cast<std::uint32_t>(number)});
    if (row == nullptr) continue;
    std::vector<std::int64_t> tids;
    for (const KeptInstance& instance : lane.instances)
      tids.push_back(instance.tid);
    std::ranges::sort(tids);
    tids.erase(std::unique(tids.begin(), tids.end()), tids.end());
    put_lane(columns, lane.instances, clock.own(host_of(lane), base), tids);
    lanes.push_back({{"callback", row - report.callbacks.data()},
                     {"count", lane.instances.size()},
                     {"of", lane.of},
                     {"tids", tids}});
  }
  const auto begin = report.trace.zero();
  return {{"base_ns", base},
          {"begin_ns", begin ? Json(clock.of_summary(*begin)) : Json(nullptr)},
          {"lanes", std::move(lanes)}};
}

void HtmlReport::write(std::ostream& out, const analysis::AnalysisResult& result,
                       const SchedulingSpec* spec, std::string_view input,
                       bool is_isolation_expected) {
  std::string columns;
  auto lanes = state_->choice.take();
  const TakenBackReleases taken_back(result.report);
  for (auto& lane : lanes) {
    for (auto& instance : lane.instances)
      instance = taken_back.corrected(instance);
  }
  Json timeline = State::lanes_json(result.report, lanes, columns);
  std::ostringstream compressed;
  GzipStream gzip(compressed);
  gzip.stream() << columns;
  gzip.finish();
  timeline["columns"] = base64(compressed.str());
  std::ostringstream text;
  JsonText json(text, JsonText::kOneLine);
  const auto add = [&json](std::string_view name, const Json& value) {
    json.key(name);
    json.verbatim(json_text(value));
  };
  json.object([&] {
    json.key("report");
    write_report(json, result.report);
    json.key("verdicts");
    write_verdicts(json, result.verdicts, {});
    json.key("input");
    json.value(input);
    json.key("spec");
    if (spec == nullptr) {
      json.null();
    } else {
      json.value(std::string_view(spec->name()));
    }
    add("head", head_json(result, {.verify = {.spec = spec},
                                   .is_isolation_expected = is_isolation_expected}));
    add("names", page_names(result, spec));
    add("histograms", histograms_json(result.report));
    add("timeline", timeline);
  });
  json.flush();
  out << "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src '"
      << csp_hash(kReportCss) << "'; script-src '" << csp_hash(kReportJs)
      << "'; base-uri 'none'; form-action 'none'\">\n"
         "<title>"
      << xml_escaped(title_of(result.report)) << "</title>\n<style>" << kReportCss
      << "</style>\n</head>\n<body>\n<noscript>This page draws its contents with a script of its "
         "own, "
         "which this browser does not run.</noscript>\n<main id=\"page\"></main>\n";
  out << "<script type=\"application/json\" id=\"document\">" << script_data(text.view())
      << "</script>\n<script>" << kReportJs << "</script>\n</body>\n</html>\n";
}

}  // namespace cie::viewer_export
