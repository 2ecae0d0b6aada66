// The babeltrace2 plugin "cie". Its macros stay in this file; each C entry point below is one
// noexcept bridge that turns exceptions into babeltrace2's errors.
#include <cie/viewer_export/version.hpp>

#include "report_sink.hpp"

#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>

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

// One more input than are connected: "in", "in1", "in2", …
bool add_input_port(bt_self_component_sink* self, std::uint64_t number) {
  const auto name = number == 0 ? std::string("in") : "in" + std::to_string(number);
  return bt_self_component_sink_add_input_port(self, name.c_str(), nullptr, nullptr) ==
         BT_SELF_COMPONENT_ADD_PORT_STATUS_OK;
}

bt_component_class_initialize_method_status initialize(
    bt_self_component_sink* self, bt_self_component_sink_configuration* /*configuration*/,
    const bt_value* params, void* /*data*/) noexcept {
  try {
    auto sink = std::make_unique<ReportSink>(params);
    if (!add_input_port(self, 0)) return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_ERROR;
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

std::uint64_t input_ports(bt_self_component_sink* self) noexcept {
  return bt_component_sink_get_input_port_count(bt_self_component_sink_as_component_sink(self));
}

bt_component_class_port_connected_method_status input_connected(
    bt_self_component_sink* self, bt_self_component_port_input* /*port*/,
    const bt_port_output* /*other*/) noexcept {
  try {
    return add_input_port(self, input_ports(self))
               ? BT_COMPONENT_CLASS_PORT_CONNECTED_METHOD_STATUS_OK
               : BT_COMPONENT_CLASS_PORT_CONNECTED_METHOD_STATUS_ERROR;
  } catch (const std::exception&) {
    return BT_COMPONENT_CLASS_PORT_CONNECTED_METHOD_STATUS_MEMORY_ERROR;
  }
}

bt_component_class_sink_graph_is_configured_method_status graph_is_configured(
    bt_self_component_sink* self) noexcept {
  try {
    for (std::uint64_t i = 0; i < input_ports(self); ++i) {
      auto* port = bt_self_component_sink_borrow_input_port_by_index(self, i);
      const auto* as_port =
          bt_self_component_port_as_port(bt_self_component_port_input_as_self_component_port(port));
      if (bt_port_is_connected(as_port) == 0) continue;
      bt_message_iterator* iterator = nullptr;
      if (bt_message_iterator_create_from_sink_component(self, port, &iterator) !=
          BT_MESSAGE_ITERATOR_CREATE_FROM_SINK_COMPONENT_STATUS_OK) {
        return BT_COMPONENT_CLASS_SINK_GRAPH_IS_CONFIGURED_METHOD_STATUS_ERROR;
      }
      sink_of(self).add_input(iterator);
    }
    return BT_COMPONENT_CLASS_SINK_GRAPH_IS_CONFIGURED_METHOD_STATUS_OK;
  } catch (const std::exception&) {
    return BT_COMPONENT_CLASS_SINK_GRAPH_IS_CONFIGURED_METHOD_STATUS_MEMORY_ERROR;
  }
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

// --- query objects: "version", "parameters" ---

bool describe(bt_value* parameters, const char* name, const char* meaning) noexcept {
  return bt_value_map_insert_string_entry(parameters, name, meaning) ==
         BT_VALUE_MAP_INSERT_ENTRY_STATUS_OK;
}

bt_component_class_query_method_status query(bt_self_component_class_sink* /*self*/,
                                             bt_private_query_executor* /*executor*/,
                                             const char* object, const bt_value* /*params*/,
                                             void* /*data*/, const bt_value** result) noexcept {
  try {
    if (object == std::string_view("version")) {
      *result =
          bt_value_string_create_init(std::string(cie::viewer_export::tool_version()).c_str());
    } else if (object == std::string_view("parameters")) {
      auto* parameters = bt_value_map_create();
      if (parameters == nullptr) return BT_COMPONENT_CLASS_QUERY_METHOD_STATUS_MEMORY_ERROR;
      *result = parameters;
      if (!(describe(parameters, "format", "text, json or csv; default text") &&
            describe(parameters, "spec", "file with a scheduling spec") &&
            describe(parameters, "output", "file to write; default standard output"))) {
        bt_value_put_ref(parameters);
        *result = nullptr;
      }
    } else {
      return BT_COMPONENT_CLASS_QUERY_METHOD_STATUS_UNKNOWN_OBJECT;
    }
    return *result != nullptr ? BT_COMPONENT_CLASS_QUERY_METHOD_STATUS_OK
                              : BT_COMPONENT_CLASS_QUERY_METHOD_STATUS_MEMORY_ERROR;
  } catch (const std::exception&) {
    return BT_COMPONENT_CLASS_QUERY_METHOD_STATUS_MEMORY_ERROR;
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
BT_PLUGIN_SINK_COMPONENT_CLASS_INPUT_PORT_CONNECTED_METHOD(report, input_connected);
BT_PLUGIN_SINK_COMPONENT_CLASS_GRAPH_IS_CONFIGURED_METHOD(report, graph_is_configured);
BT_PLUGIN_SINK_COMPONENT_CLASS_QUERY_METHOD(report, query);
BT_PLUGIN_SINK_COMPONENT_CLASS_DESCRIPTION(report,
                                           "Prints response times, mapping and defects of a trace");
BT_PLUGIN_SINK_COMPONENT_CLASS_HELP(
    report,
    "Parameters: format (text, json or csv), spec (a scheduling spec), output (a file).\n"
    "Queries: version, parameters.\n"
    "Example: babeltrace2 TRACE -c sink.cie.report -p 'format=\"json\"'\n"
    "See babeltrace2-sink.cie.report(7).");
