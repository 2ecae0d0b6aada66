// What one sink.cie.report component holds: its parameters, an analyzer, and where the report goes.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/message_feeder.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "message_merger.hpp"

#include <memory>
#include <optional>
#include <string>

#include <babeltrace2/babeltrace.h>

namespace cie::viewer_export {

class ReportSink {
 public:
  // Parameters: `format` ("text", "json" or "csv"; default "text"), `spec` (a file), `output` (a
  // file; default standard output). Throws std::invalid_argument for others, SpecError for a bad
  // spec.
  explicit ReportSink(const bt_value* params);
  ReportSink(const ReportSink&) = delete;
  ReportSink& operator=(const ReportSink&) = delete;

  // Takes over the iterator's reference. Inputs are merged by time.
  void add_input(bt_message_iterator* iterator) { inputs_.add(iterator); }
  // Pulls one batch; the status is what babeltrace2 expects of a sink. Writes the report at the
  // end.
  bt_component_class_sink_consume_method_status consume();

 private:
  void finish();

  std::string format_ = "text";
  std::string output_;
  std::optional<SchedulingSpec> spec_;
  std::unique_ptr<analysis::Analyzer> analyzer_;
  std::unique_ptr<analysis::MessageFeeder> feeder_;
  MessageMerger inputs_;
};

}  // namespace cie::viewer_export
