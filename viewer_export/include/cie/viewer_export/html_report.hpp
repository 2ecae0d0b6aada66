// The report as one HTML page that needs no network and no other file.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstddef>
#include <memory>
#include <ostream>

namespace cie::viewer_export {

// Collects what the page's pictures need while the analyzer goes, and writes the page. Every number
// of its tables is the report's; its histograms need AnalysisOptions::keep_buckets. Memory is bounded: of more
// than `max_timeline` instances the timeline keeps an even choice, and beside it the slowest of
// each callback and those that missed releases or never ended; the page says so. Not thread-safe.
class HtmlReport final : public analysis::Observer {
 public:
  static constexpr std::size_t kMaxTimeline = 200'000;

  explicit HtmlReport(std::size_t max_timeline = kMaxTimeline);
  ~HtmlReport() override;
  HtmlReport(const HtmlReport&) = delete;
  HtmlReport& operator=(const HtmlReport&) = delete;

  void on_instance(const analysis::Instance& instance) override;

  // `spec`, which was given to the analyzer, may be null; it is named. `input` as for write_report_text(),
  // `is_isolation_expected` as in ReportContext. Call it once. Throws what the stream throws.
  void write(std::ostream& out, const analysis::AnalysisResult& result, const SchedulingSpec* spec,
             std::string_view input = "TRACE", bool is_isolation_expected = false);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cie::viewer_export
