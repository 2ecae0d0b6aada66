// What graphs of libbabeltrace2 have in common: finding plugins, our sink, reasons of failures.
#pragma once

#include "bt_handles.hpp"
#include "message_decoder.hpp"

#include <exception>
#include <string>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

// What libbabeltrace2 recorded about the failure on this thread, innermost cause of a component
// first of all, without its own addresses, which differ from run to run. Clears it; may be empty.
std::string take_cause();

// Throws UnreadableTrace.
Plugin find_plugin(const char* name);

// Where messages arrive: feeds a decoder. What the decoder throws is kept in `error`.
struct Sink {
  MessageDecoder* decoder;
  std::exception_ptr error;
};

// For bt_graph_add_simple_sink_component(); `data` is a Sink.
bt_graph_simple_sink_component_consume_func_status consume(bt_message_iterator* iterator,
                                                           void* data) noexcept;

}  // namespace cie::analysis::bt
