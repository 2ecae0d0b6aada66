#include <cie/viewer_export/html_report.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/verify_writers.hpp>

#include "html_files.hpp"
#include "json/json.hpp"
#include "output/base64.hpp"
#include "output/gzip_stream.hpp"
#include "timelines/timeline_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace cie::viewer_export {
namespace {

// Histograms have bins of equal width on a logarithmic axis, from 1 ns to 1000 s.
constexpr int kBinsPerDecade = 20;
constexpr std::size_t kBins = 12 * kBinsPerDecade;
using Histogram = std::array<std::uint64_t, kBins>;

std::size_t bin_of(std::int64_t ns) {
  if (ns <= 1) return 0;
  const auto bin = std::floor(std::log10(static_cast<double>(ns)) * kBinsPerDecade);
  return std::min(static_cast<std::size_t>(bin), kBins - 1);
}

std::optional<std::int64_t> ns_of(const std::optional<analysis::Duration>& duration) {
  if (!duration) return std::nullopt;
  return duration->ns;
}

// --- the timeline's columns: LEB128 numbers, lane after lane, column after column
// -----------------

void put(std::string& out, std::uint64_t value) {
  while (value >= 0x80) {
    out += static_cast<char>((value & 0x7fU) | 0x80U);
    value >>= 7U;
  }
  out += static_cast<char>(value);
}

std::uint64_t zigzag(std::int64_t value) {
  return static_cast<std::uint64_t>(value) << 1U ^ static_cast<std::uint64_t>(value >> 63);
}

// Zero for what is not known.
void put_optional(std::string& out, const std::optional<std::int64_t>& value) {
  put(out, value ? zigzag(*value) + 1 : 0);
}

template <typename Get>
void put_column(std::string& out, const std::vector<TimelineInstance>& instances, Get get) {
  for (const TimelineInstance& instance : instances)
    put_optional(out, get(instance));
}

void put_lane(std::string& out, const std::vector<TimelineInstance>& instances, std::int64_t base,
              const std::vector<std::int64_t>& tids) {
  std::int64_t before = base;
  for (const TimelineInstance& i : instances)
    put(out, zigzag(i.start - std::exchange(before, i.start)));
  put_column(out, instances, [](const TimelineInstance& i) -> std::optional<std::int64_t> {
    if (!i.release) return std::nullopt;
    return i.start - *i.release;
  });
  put_column(out, instances, [](const TimelineInstance& i) -> std::optional<std::int64_t> {
    if (!i.end) return std::nullopt;
    return *i.end - i.start;
  });
  put_column(out, instances, [](const TimelineInstance& i) { return i.execution; });
  put_column(out, instances, [](const TimelineInstance& i) { return i.preempted; });
  put_column(out, instances, [](const TimelineInstance& i) { return i.blocked; });
  put_column(out, instances, [](const TimelineInstance& i) { return i.wake_delay; });
  std::int64_t seq_before = 0;
  for (const TimelineInstance& i : instances) {
    const auto seq = static_cast<std::int64_t>(i.seq);
    put(out, zigzag(seq - std::exchange(seq_before, seq)));
  }
  for (const TimelineInstance& i : instances) {
    const auto place = std::ranges::lower_bound(tids, i.tid) - tids.begin();
    put(out, static_cast<std::uint64_t>(place) << 1U | (i.is_release_exact ? 1U : 0U));
  }
}

// JSON within a script element: nothing in it may look like the element's end.
std::string script_data(const std::string& json) {
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

std::string report_text(const analysis::Report& report) {
  std::ostringstream out;
  write_report_json(out, report);
  return out.str();
}

std::string verdicts_text(const analysis::VerdictReport& verdicts) {
  std::ostringstream out;
  write_verify_json(out, verdicts);
  return out.str();
}

void write_data(std::ostream& out, const char* id, const std::string& json) {
  out << "<script type=\"application/json\" id=\"" << id << "\">" << script_data(json)
      << "</script>\n";
}

// That of the spec, else what the callback declares itself: as rule R3 judges.
Json deadline_json(const analysis::CallbackReport& callback, const SchedulingSpec* spec) {
  const SpecEntry* entry = spec == nullptr ? nullptr : spec->find_callback(callback.logical_id);
  if (entry != nullptr && entry->response_deadline_ns) return Json(*entry->response_deadline_ns);
  return optional_json(callback.deadline_ns);
}

}  // namespace

struct HtmlReport::State {
  explicit State(std::size_t max_timeline) : choice(max_timeline) {}

  Json facts_json(const analysis::AnalysisResult& result, const SchedulingSpec* spec,
                  std::string_view input) const;
  static Json lanes_json(const analysis::Report& report,
                         const std::vector<TimelineChoice::Kept>& kept, std::string& columns);

  std::vector<Histogram> responses;  // by analysis::Instance::callback
  TimelineChoice choice;
};

HtmlReport::HtmlReport(std::size_t max_timeline) : state_(std::make_unique<State>(max_timeline)) {}
HtmlReport::~HtmlReport() = default;

void HtmlReport::on_instance(const analysis::Instance& instance) {
  const auto number = at(instance.callback);
  if (number >= state_->responses.size()) state_->responses.resize(number + 1);
  TimelineInstance row{
      .start = instance.start.ns,
      .execution = ns_of(instance.execution),
      .preempted = ns_of(instance.preempted),
      .blocked = ns_of(instance.blocked),
      .wake_delay = ns_of(instance.wake_delay),
      .tid = instance.tid,
      .seq = instance.seq,
      .missed = instance.missed,
      .is_release_exact = instance.release_source == analysis::ReleaseSource::exact};
  if (instance.release) row.release = instance.release->ns;
  if (instance.end) row.end = instance.end->ns;
  if (const auto response = row.response();
      response && instance.state == analysis::InstanceState::complete) {
    ++state_->responses[number][bin_of(*response)];
  }
  state_->choice.add(number, row);
}

// What the page says beyond report and verdicts; callbacks as the report lists them.
Json HtmlReport::State::facts_json(const analysis::AnalysisResult& result,
                                   const SchedulingSpec* spec, std::string_view input) const {
  Json facts{{"bins_per_decade", kBinsPerDecade},
             {"input", input},
             {"spec", spec == nullptr ? Json(nullptr) : Json(spec->name())},
             {"callbacks", Json::array()}};
  for (const analysis::CallbackReport& callback : result.report.callbacks) {
    Json bins = Json::array();
    if (const auto number = at(callback.index); number < responses.size()) {
      for (std::size_t bin = 0; bin < kBins; ++bin) {
        const auto count = responses[number][bin];
        if (count > 0) bins.push_back(Json::array({bin, count}));
      }
    }
    facts["callbacks"].push_back(
        {{"deadline_ns", deadline_json(callback, spec)}, {"responses", std::move(bins)}});
  }
  return facts;
}

Json HtmlReport::State::lanes_json(const analysis::Report& report,
                                   const std::vector<TimelineChoice::Kept>& kept,
                                   std::string& columns) {
  std::int64_t base = std::numeric_limits<std::int64_t>::max();
  for (const auto& lane : kept)
    if (!lane.instances.empty()) base = std::min(base, lane.instances.front().start);
  if (base == std::numeric_limits<std::int64_t>::max()) base = 0;
  Json lanes = Json::array();
  for (std::size_t number = 0; number < kept.size(); ++number) {
    const auto& lane = kept[number];
    if (lane.instances.empty()) continue;
    const auto row = std::ranges::find(report.callbacks,
                                       analysis::CallbackIndex{static_cast<std::uint32_t>(number)},
                                       &analysis::CallbackReport::index);
    if (row == report.callbacks.end()) continue;
    std::vector<std::int64_t> tids;
    for (const TimelineInstance& instance : lane.instances)
      tids.push_back(instance.tid);
    std::ranges::sort(tids);
    tids.erase(std::unique(tids.begin(), tids.end()), tids.end());
    put_lane(columns, lane.instances, base, tids);
    lanes.push_back({{"callback", row - report.callbacks.begin()},
                     {"count", lane.instances.size()},
                     {"of", lane.of},
                     {"tids", tids}});
  }
  return {{"base_ns", base}, {"lanes", std::move(lanes)}};
}

void HtmlReport::write(std::ostream& out, const analysis::AnalysisResult& result,
                       const SchedulingSpec* spec, std::string_view input) {
  std::string columns;
  const Json lanes = state_->lanes_json(result.report, state_->choice.take(), columns);
  std::ostringstream compressed;
  GzipStream gzip(compressed);
  gzip.stream() << columns;
  gzip.finish();
  out << "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src '"
      << csp_hash(kReportCss) << "'; script-src '" << csp_hash(kReportJs)
      << "'; base-uri 'none'; form-action 'none'\">\n"
         "<title>cie report</title>\n<style>"
      << kReportCss
      << "</style>\n</head>\n<body>\n<noscript>This page draws its contents with a script of its "
         "own, "
         "which this browser does not run.</noscript>\n<main id=\"page\"></main>\n";
  write_data(out, "report", report_text(result.report));
  write_data(out, "verdicts", verdicts_text(result.verdicts));
  write_data(
      out, "facts",
      state_->facts_json(result, spec, input).dump(-1, ' ', false, Json::error_handler_t::replace));
  write_data(out, "lanes", lanes.dump(-1, ' ', false, Json::error_handler_t::replace));
  out << "<script type=\"application/octet-stream\" id=\"columns\">" << base64(compressed.str())
      << "</script>\n<script>" << kReportJs << "</script>\n</body>\n</html>\n";
}

}  // namespace cie::viewer_export
