// The babeltrace2 plugin "cie". Its macros stay in this file; each C entry point below is one
// noexcept bridge that turns exceptions into babeltrace2's errors.
#include "report_sink.hpp"

#include <exception>
#include <memory>
#include <new>

#include <babeltrace2/babeltrace.h>

namespace {

using cie::viewer_export::ReportSink;

ReportSink& sink_of(bt_self_component_sink* self) noexcept {
  return *static_cast<ReportSink*>(
      bt_self_component_get_data(bt_self_component_sink_as_self_component(self)));
}

void append_cause(bt_self_component_sink* self, const char* what) noexcept {
  BT_CURRENT_THREAD_ERROR_APPEND_CAUSE_FROM_COMPONENT(
      bt_self_component_sink_as_self_component(self), "%s", what);
}

bt_component_class_initialize_method_status initialize(
    bt_self_component_sink* self, bt_self_component_sink_configuration* /*configuration*/,
    const bt_value* params, void* /*data*/) noexcept {
  try {
    auto sink = std::make_unique<ReportSink>(params);
    if (bt_self_component_sink_add_input_port(self, "in", nullptr, nullptr) !=
        BT_SELF_COMPONENT_ADD_PORT_STATUS_OK) {
      return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_ERROR;
    }
    bt_self_component_set_data(bt_self_component_sink_as_self_component(self), sink.release());
    return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_OK;
  } catch (const std::bad_alloc&) {
    return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_MEMORY_ERROR;
  } catch (const std::exception& error) {
    append_cause(self, error.what());
    return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_ERROR;
  }
}

void finalize(bt_self_component_sink* self) noexcept { delete &sink_of(self); }

bt_component_class_sink_graph_is_configured_method_status graph_is_configured(
    bt_self_component_sink* self) noexcept {
  bt_message_iterator* iterator = nullptr;
  auto* port = bt_self_component_sink_borrow_input_port_by_index(self, 0);
  if (bt_message_iterator_create_from_sink_component(self, port, &iterator) !=
      BT_MESSAGE_ITERATOR_CREATE_FROM_SINK_COMPONENT_STATUS_OK) {
    return BT_COMPONENT_CLASS_SINK_GRAPH_IS_CONFIGURED_METHOD_STATUS_ERROR;
  }
  sink_of(self).set_iterator(iterator);
  return BT_COMPONENT_CLASS_SINK_GRAPH_IS_CONFIGURED_METHOD_STATUS_OK;
}

bt_component_class_sink_consume_method_status consume(bt_self_component_sink* self) noexcept {
  try {
    return sink_of(self).consume();
  } catch (const std::bad_alloc&) {
    return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_MEMORY_ERROR;
  } catch (const std::exception& error) {
    append_cause(self, error.what());
    return BT_COMPONENT_CLASS_SINK_CONSUME_METHOD_STATUS_ERROR;
  }
}

}  // namespace

BT_PLUGIN_MODULE();
BT_PLUGIN(cie);
BT_PLUGIN_DESCRIPTION("Response times of isolated callbacks");
BT_PLUGIN_LICENSE("Apache-2.0");
BT_PLUGIN_SINK_COMPONENT_CLASS(report, consume);
BT_PLUGIN_SINK_COMPONENT_CLASS_INITIALIZE_METHOD(report, initialize);
BT_PLUGIN_SINK_COMPONENT_CLASS_FINALIZE_METHOD(report, finalize);
BT_PLUGIN_SINK_COMPONENT_CLASS_GRAPH_IS_CONFIGURED_METHOD(report, graph_is_configured);
BT_PLUGIN_SINK_COMPONENT_CLASS_DESCRIPTION(report,
                                           "Prints response times, mapping and defects of a trace");
BT_PLUGIN_SINK_COMPONENT_CLASS_HELP(
    report,
    "Parameters: format (text, json or csv), spec (a scheduling spec), output (a file).\n"
    "Example: babeltrace2 TRACE -c sink.cie.report -p 'format=\"json\"'");
