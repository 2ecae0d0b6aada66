#include <cie/analysis/live_reader.hpp>

#include "bt_graph.hpp"

#include <memory>
#include <utility>

namespace cie::analysis {
namespace {

using bt::Plugin;
using bt::Value;

[[noreturn]] void fail(const std::string& what) {
  const auto cause = bt::take_cause();
  throw UnreadableTrace(what + (cause.empty() ? "" : ": " + cause));
}

std::string text_of(const bt_value* map, const char* key) {
  const auto* value = bt_value_map_borrow_entry_value_const(map, key);
  if (value == nullptr || bt_value_get_type(value) != BT_VALUE_TYPE_STRING) return {};
  return bt_value_string_get(value);
}

std::uint64_t number_of(const bt_value* map, const char* key) {
  const auto* value = bt_value_map_borrow_entry_value_const(map, key);
  if (value == nullptr || bt_value_get_type(value) != BT_VALUE_TYPE_UNSIGNED_INTEGER) return 0;
  return bt_value_integer_unsigned_get(value);
}

const bt_component_class_source* live_class(const Plugin& plugin) {
  const auto* found =
      bt_plugin_borrow_source_component_class_by_name_const(plugin.get(), "lttng-live");
  if (found == nullptr) throw UnreadableTrace("this babeltrace2 has no source.ctf.lttng-live");
  return found;
}

Value parameters_of(const std::string& url) {
  Value owned(bt_value_map_create());
  auto* map = const_cast<bt_value*>(owned.get());
  const Value inputs(bt_value_array_create());
  auto* array = const_cast<bt_value*>(inputs.get());
  bt_value_array_append_string_element(array, url.c_str());
  bt_value_map_insert_entry(map, "inputs", array);
  bt_value_map_insert_string_entry(map, "session-not-found-action", "fail");
  return owned;
}

}  // namespace

std::vector<LiveSession> live_sessions(const std::string& relay) {
  const auto plugin = bt::find_plugin("ctf");
  const Value parameters(bt_value_map_create());
  auto* map = const_cast<bt_value*>(parameters.get());
  bt_value_map_insert_string_entry(map, "url", relay.c_str());
  const bt::QueryExecutor query(bt_query_executor_create(
      bt_component_class_source_as_component_class_const(live_class(plugin)), "sessions", map));
  const bt_value* result = nullptr;
  if (bt_query_executor_query(const_cast<bt_query_executor*>(query.get()), &result) !=
      BT_QUERY_EXECUTOR_QUERY_STATUS_OK) {
    fail("no relay daemon answers at " + relay);
  }
  const Value owned(result);
  std::vector<LiveSession> sessions;
  if (bt_value_get_type(result) != BT_VALUE_TYPE_ARRAY) return sessions;
  for (std::uint64_t i = 0; i < bt_value_array_get_length(result); ++i) {
    const auto* entry = bt_value_array_borrow_element_by_index_const(result, i);
    LiveSession session;
    session.url = text_of(entry, "url");
    session.host = text_of(entry, "target-hostname");
    session.name = text_of(entry, "session-name");
    session.streams = number_of(entry, "stream-count");
    session.clients = number_of(entry, "client-count");
    sessions.push_back(std::move(session));
  }
  return sessions;
}

struct LiveInput::Shared {
  explicit Shared(Analyzer& analyzer) : input(analyzer) {}
  bt::AnalyzerInput input;
};

LiveInput::LiveInput(Analyzer& analyzer) : shared_(std::make_unique<Shared>(analyzer)) {}
LiveInput::~LiveInput() = default;

void LiveInput::finish() { shared_->input.finish(); }

struct LiveReader::Graph {
  Graph(std::string source_url, bt::AnalyzerInput& input)
      : url(std::move(source_url)), decoder(input) {}

  std::string url;
  Plugin plugin = bt::find_plugin("ctf");
  bt::MessageDecoder decoder;
  bt::Sink sink{.decoder = &decoder, .error = nullptr};
  bt::Graph graph{bt_graph_create(0)};  // last: it ends before what it feeds
};

LiveReader::LiveReader(const std::string& url, LiveInput& input)
    : graph_(std::make_unique<Graph>(url, input.shared_->input)) {
  auto* graph = const_cast<bt_graph*>(graph_->graph.get());
  const auto parameters = parameters_of(url);
  const bt_component_source* source = nullptr;
  if (bt_graph_add_source_component(graph, live_class(graph_->plugin), "live", parameters.get(),
                                    BT_LOGGING_LEVEL_NONE,
                                    &source) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
    fail("cannot read " + url);
  }
  const bt_component_sink* sink = nullptr;
  if (bt_graph_add_simple_sink_component(graph, "analyzer", nullptr, bt::consume, nullptr,
                                         &graph_->sink,
                                         &sink) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
    fail("cannot set up reading");
  }
  if (bt_graph_connect_ports(graph,
                             bt_component_source_borrow_output_port_by_index_const(source, 0),
                             bt_component_sink_borrow_input_port_by_index_const(sink, 0),
                             nullptr) != BT_GRAPH_CONNECT_PORTS_STATUS_OK) {
    fail("cannot set up reading");
  }
}

LiveReader::~LiveReader() = default;

void LiveReader::give_up() { graph_->decoder.give_up(); }

std::vector<std::uint32_t> LiveReader::traces() const { return graph_->decoder.traces(); }

LiveReader::Step LiveReader::step() {
  switch (bt_graph_run_once(const_cast<bt_graph*>(graph_->graph.get()))) {
    case BT_GRAPH_RUN_ONCE_STATUS_OK:
      return Step::events;
    case BT_GRAPH_RUN_ONCE_STATUS_AGAIN:
      return Step::nothing;
    case BT_GRAPH_RUN_ONCE_STATUS_END:
      return Step::end;
    default:
      break;
  }
  if (graph_->sink.error) {
    bt_current_thread_clear_error();
    std::rethrow_exception(graph_->sink.error);
  }
  fail("cannot go on reading " + graph_->url);
}

}  // namespace cie::analysis
