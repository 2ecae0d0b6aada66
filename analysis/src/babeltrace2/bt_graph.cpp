#include "bt_graph.hpp"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace cie::analysis::bt {
namespace {

// Drops every ", something-addr=0x…" and control characters.
std::string without_addresses(std::string_view text) {
  std::string kept;
  while (!text.empty()) {
    const auto comma = std::min(text.find(','), text.size());
    const auto part = text.substr(0, comma);
    if (part.find("-addr=0x") == std::string_view::npos) {
      if (!kept.empty()) kept += ',';
      kept += part;
    } else if (const auto colon = part.find(':'); colon != std::string_view::npos) {
      if (!kept.empty()) kept += ',';
      kept += part.substr(0, colon);  // "Invalid CTF magic number: msg-it-addr=0x…"
    }
    text.remove_prefix(std::min(comma + 1, text.size()));
  }
  std::erase_if(kept, [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  return kept;
}

}  // namespace

std::string take_cause() {
  const auto* error = bt_current_thread_take_error();
  if (error == nullptr) return {};
  std::string text;
  for (std::uint64_t i = 0; i < bt_error_get_cause_count(error) && text.empty(); ++i) {
    const auto* cause = bt_error_borrow_cause_by_index(error, i);
    if (bt_error_cause_get_actor_type(cause) != BT_ERROR_CAUSE_ACTOR_TYPE_UNKNOWN) {
      text = bt_error_cause_get_message(cause);
    }
  }
  bt_error_release(error);
  text = without_addresses(text);
  constexpr std::size_t kMaxLength = 300;
  if (text.size() > kMaxLength) text.resize(kMaxLength);
  return text;
}

Plugin find_plugin(const char* name) {
  const bt_plugin* plugin = nullptr;
  const auto status = bt_plugin_find(name, BT_TRUE, BT_TRUE, BT_TRUE, BT_TRUE, BT_FALSE, &plugin);
  if (status != BT_PLUGIN_FIND_STATUS_OK) {
    throw UnreadableTrace(std::string("cannot load babeltrace2's plugin \"") + name +
                          "\" (is the package babeltrace2 installed?): " + take_cause());
  }
  return Plugin(plugin);
}

bt_graph_simple_sink_component_consume_func_status consume(bt_message_iterator* iterator,
                                                           void* data) noexcept {
  auto& sink = *static_cast<Sink*>(data);
  bt_message_array_const messages = nullptr;
  std::uint64_t count = 0;
  switch (bt_message_iterator_next(iterator, &messages, &count)) {
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_OK:
      break;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_END:
      return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_END;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_AGAIN:
      return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_AGAIN;
    case BT_MESSAGE_ITERATOR_NEXT_STATUS_MEMORY_ERROR:
      return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_MEMORY_ERROR;
    default:
      return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_ERROR;
  }
  for (std::uint64_t i = 0; i < count; ++i) {
    const Message message(messages[i]);
    if (sink.error) continue;
    try {
      sink.decoder->consume(message.get());
    } catch (...) {
      sink.error = std::current_exception();
    }
  }
  return sink.error ? BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_ERROR
                    : BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_OK;
}

}  // namespace cie::analysis::bt
