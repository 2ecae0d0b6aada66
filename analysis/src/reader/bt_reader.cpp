#include "bt_reader.hpp"

#include "../ctf/metadata_file.hpp"
#include "../guard_state.hpp"
#include "bt_graph.hpp"
#include "discovery.hpp"
#include "message_decoder.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {
namespace {

[[noreturn]] void fail(const std::string& what) {
  const auto cause = take_cause();
  throw UnreadableTrace(what + (cause.empty() ? "" : ": " + cause) +
                        "; compare its files with the recording's manifest, or record again");
}

// libbabeltrace2 2.0 says only that it does not understand such metadata.
void refuse_ctf2(const std::filesystem::path& directory) {
  std::array<char, 256> begin{};
  std::ifstream file(directory / "metadata", std::ios::binary);
  file.read(begin.data(), begin.size());
  const std::string_view bytes(begin.data(), static_cast<std::size_t>(file.gcount()));
  if (!ctf::is_text_sequence(bytes)) return;
  throw UnreadableTrace(
      "cannot read trace " + directory.string() +
      ": it is of CTF 2, which libbabeltrace2 2.0 does not know; cie's own reader "
      "reads it (--reader native)");
}

// Directories that belong to one trace (rotation chunks share a uuid) are read as one, so that
// their packets form one sequence per stream.
std::string group_of(const bt_component_class_source* source, const std::filesystem::path& path) {
  const Value params(bt_value_map_create());
  auto* map = const_cast<bt_value*>(params.get());
  bt_value_map_insert_string_entry(map, "input", path.c_str());
  bt_value_map_insert_string_entry(map, "type", "directory");
  const QueryExecutor query(bt_query_executor_create(
      bt_component_class_source_as_component_class_const(source), "babeltrace.support-info", map));
  const bt_value* result = nullptr;
  const auto status = bt_query_executor_query(const_cast<bt_query_executor*>(query.get()), &result);
  if (status != BT_QUERY_EXECUTOR_QUERY_STATUS_OK) {
    fail("cannot read trace " + path.string() + ": its metadata is not CTF, or is damaged");
  }
  const Value owned(result);
  const bt_value* group = nullptr;
  if (bt_value_get_type(result) == BT_VALUE_TYPE_MAP) {
    group = bt_value_map_borrow_entry_value_const(result, "group");
  }
  if (group == nullptr || bt_value_get_type(group) != BT_VALUE_TYPE_STRING) return path.string();
  return bt_value_string_get(group);
}

Value inputs_of(const std::vector<std::filesystem::path>& directories) {
  auto* inputs = bt_value_array_create();
  for (const auto& directory : directories) {
    bt_value_array_append_string_element(inputs, directory.c_str());
  }
  auto* params = bt_value_map_create();
  bt_value_map_insert_entry(params, "inputs", inputs);
  bt_value_put_ref(inputs);
  return Value(params);
}

void connect_outputs(bt_graph* graph, const bt_component_source* source,
                     const bt_component_filter* muxer) {
  const auto count = bt_component_source_get_output_port_count(source);
  for (std::uint64_t i = 0; i < count; ++i) {
    // The muxer offers one more free input port each time one is connected.
    const auto free = bt_component_filter_get_input_port_count(muxer) - 1;
    const auto status = bt_graph_connect_ports(
        graph, bt_component_source_borrow_output_port_by_index_const(source, i),
        bt_component_filter_borrow_input_port_by_index_const(muxer, free), nullptr);
    if (status != BT_GRAPH_CONNECT_PORTS_STATUS_OK) fail("cannot connect a stream of the trace");
  }
}

}  // namespace

void read_traces(std::span<const std::filesystem::path> traces, Analyzer& analyzer) {
  const auto ctf = find_plugin("ctf");
  const auto utils = find_plugin("utils");
  const auto* source_class = bt_plugin_borrow_source_component_class_by_name_const(ctf.get(), "fs");
  const auto* muxer_class =
      bt_plugin_borrow_filter_component_class_by_name_const(utils.get(), "muxer");

  std::map<std::string, std::vector<std::filesystem::path>> groups;
  for (const auto& path : traces) {
    for (const auto& directory : find_traces(path)) {
      refuse_ctf2(directory);
      groups[group_of(source_class, directory)].push_back(directory);
      guard_tick();
    }
  }

  const Graph owned(bt_graph_create(0));
  auto* graph = const_cast<bt_graph*>(owned.get());
  const bt_component_filter* muxer = nullptr;
  if (bt_graph_add_filter_component(graph, muxer_class, "muxer", nullptr, BT_LOGGING_LEVEL_NONE,
                                    &muxer) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
    fail("cannot set up reading");
  }
  std::uint64_t ports = 0;
  for (const auto& [group, directories] : groups) {
    const auto params = inputs_of(directories);
    const bt_component_source* source = nullptr;
    const auto name = "trace " + std::to_string(ports) + " " + directories.front().string();
    if (bt_graph_add_source_component(graph, source_class, name.c_str(), params.get(),
                                      BT_LOGGING_LEVEL_NONE,
                                      &source) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
      fail("cannot read trace " + directories.front().string());
    }
    connect_outputs(graph, source, muxer);
    ports += bt_component_source_get_output_port_count(source);
    guard_tick();
  }
  if (ports == 0) return;  // metadata without any stream: an empty recording

  MessageDecoder decoder(analyzer);
  Sink sink{.decoder = &decoder, .error = nullptr};
  const bt_component_sink* sink_component = nullptr;
  if (bt_graph_add_simple_sink_component(graph, "analyzer", nullptr, consume, nullptr, &sink,
                                         &sink_component) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
    fail("cannot set up reading");
  }
  if (bt_graph_connect_ports(graph, bt_component_filter_borrow_output_port_by_index_const(muxer, 0),
                             bt_component_sink_borrow_input_port_by_index_const(sink_component, 0),
                             nullptr) != BT_GRAPH_CONNECT_PORTS_STATUS_OK) {
    fail("cannot set up reading");
  }
  for (;;) {
    const auto status = bt_graph_run_once(graph);
    if (status == BT_GRAPH_RUN_ONCE_STATUS_OK || status == BT_GRAPH_RUN_ONCE_STATUS_AGAIN) continue;
    if (status == BT_GRAPH_RUN_ONCE_STATUS_END) return;
    if (sink.error) {
      bt_current_thread_clear_error();
      std::rethrow_exception(sink.error);
    }
    const auto cause = take_cause();
    if (decoder.events() == 0) throw UnreadableTrace("cannot read any event: " + cause);
    decoder.damaged(cause);
    return;
  }
}

}  // namespace cie::analysis::bt
