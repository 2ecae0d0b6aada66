#include "report_sink.hpp"

#include <cie/viewer_export/output_file.hpp>
#include <cie/viewer_export/report_writers.hpp>

#include <exception>
#include <ostream>
#include <stdexcept>
#include <string_view>

namespace cie::viewer_export {
namespace {

std::string text_of(const bt_value* value, const char* key) {
  if (bt_value_get_type(value) != BT_VALUE_TYPE_STRING) {
    throw std::invalid_argument(std::string("parameter \"") + key + "\" must be a string");
  }
  return bt_value_string_get(value);
}

// Parameters of a component, checked one by one as babeltrace2 hands them out.
struct Parameters {
  std::string format = "text";
  std::string spec;
  std::string output;
  std::exception_ptr error;

  static bt_value_map_foreach_entry_const_func_status take(const char* key, const bt_value* value,
                                                           void* data) noexcept {
    auto& parameters = *static_cast<Parameters*>(data);
    try {
      const std::string_view name = key;
      if (name == "format") {
        parameters.format = text_of(value, key);
      } else if (name == "spec") {
        parameters.spec = text_of(value, key);
      } else if (name == "output") {
        parameters.output = text_of(value, key);
      } else {
        throw std::invalid_argument(std::string("unknown parameter \"") + key +
                                    "\"; there are format, spec and output");
      }
      return BT_VALUE_MAP_FOREACH_ENTRY_CONST_FUNC_STATUS_OK;
    } catch (...) {
      parameters.error = std::current_exception();
      return BT_VALUE_MAP_FOREACH_ENTRY_CONST_FUNC_STATUS_INTERRUPT;
    }
  }
};

}  // namespace

ReportSink::ReportSink(const bt_value* params) {
  Parameters parameters;
  bt_value_map_foreach_entry_const(params, Parameters::take, &parameters);
  if (parameters.error) {
    bt_current_thread_clear_error();
    std::rethrow_exception(parameters.error);
  }
  format_ = parameters.format;
  output_ = parameters.output;
  if (format_ != "text" && format_ != "json" && format_ != "csv") {
    throw std::invalid_argument("parameter \"format\" is \"" + format_ +
                                "\"; there are text, json and csv");
  }
  analysis::AnalysisOptions options;
  if (!parameters.spec.empty()) {
    spec_ = SchedulingSpec::load(parameters.spec);
    options.spec = &*spec_;
  }
  analyzer_ = std::make_unique<analysis::Analyzer>(options);
  feeder_ = std::make_unique<analysis::MessageFeeder>(*analyzer_);
}

bt_component_class_sink_consume_method_status ReportSink::consume() {
  const auto status =
      inputs_.next([this](const bt_message* message) { feeder_->consume(message); });
  switch (status) {
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_OK:
      return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_OK;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_END:
      finish();
      return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_END;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_AGAIN:
      return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_AGAIN;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_MEMORY_ERROR:
      return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_MEMORY_ERROR;
    default:
      return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_ERROR;
  }
}

void ReportSink::finish() {
  feeder_->finish();
  auto result = analyzer_->finish();
  // What a recording's manifest names may be gone: nobody reads it here, so nothing is known to be
  // complete, and no rule's pass is told.
  result.report.trace.complete = false;
  const bool is_told = result.verdicts.verdict != analysis::Verdict::pass;
  OutputFile file(output_.empty() ? "-" : output_);
  const bool is_csv = format_ == "csv";
  const auto write = [&](std::ostream& out) {
    if (format_ == "json") {
      write_report_json(out, result.report);
    } else if (is_csv) {
      write_report_csv(out, result.report);
    } else {
      write_report_text(out, result.report, is_told ? &result.verdicts : nullptr, TextStyle{});
    }
  };
  write_data(file, write, is_csv);
}

}  // namespace cie::viewer_export
