#include <cie/viewer_export/graph_writer.hpp>

#include "text_layout.hpp"

#include <map>
#include <set>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::GraphEdge;
using analysis::GraphNode;
using analysis::Report;

// The inside of a quoted string; "\n" is DOT's own line break and comes from us alone.
std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : printable(text)) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

std::string node_name(const GraphNode& node) {
  return fmt::format("\"{} {}\"", node.pid, escaped(node.logical_id));
}

std::string topic_name(const std::string& topic) {
  return fmt::format("\"topic {}\"", escaped(topic));
}

std::string label_of(const CallbackReport& callback) {
  auto label = escaped(callback.logical_id);
  if (const auto& response = callback.response_time) {
    label += fmt::format("\\nresponse p99 {}, max {}", format_duration(response->p99),
                         format_duration(response->max));
  }
  return label;
}

void write_processes(std::ostream& out, const Report& report) {
  std::map<std::int64_t, std::string> names;
  for (const auto& process : report.processes)
    names[process.pid] = process.name;
  std::map<std::int64_t, std::map<std::string, std::string>> nodes;  // by process, then by name
  for (const auto& callback : report.callbacks) {
    nodes[callback.pid][node_name({callback.logical_id, callback.pid})] = label_of(callback);
  }
  for (const auto& [pid, callbacks] : nodes) {
    const auto name = names[pid].empty() ? "pid " : names[pid] + ", pid ";
    out << fmt::format("  subgraph \"cluster_{0}\" {{\n    label=\"{1}{0}\";\n", pid,
                       escaped(name));
    for (const auto& [node, label] : callbacks)
      out << fmt::format("    {} [label=\"{}\"];\n", node, label);
    out << "  }\n";
  }
}

void write_edge(std::ostream& out, const GraphEdge& edge) {
  auto label = fmt::format("{}\\n{}", escaped(edge.topic), counted(edge.messages, "message"));
  if (const auto& latency = edge.communication) {
    label += fmt::format("\\nlatency p50 {}, max {}", format_duration(latency->p50),
                         format_duration(latency->max));
  }
  if (edge.clock_error) {
    label += fmt::format("\\nclocks: {}", format_clock_error(*edge.clock_error));
  }
  const bool is_inside = edge.from && edge.from->pid == edge.to.pid;
  out << fmt::format("  {} -> {} [label=\"{}\"{}];\n",
                     edge.from ? node_name(*edge.from) : topic_name(edge.topic), node_name(edge.to),
                     label, is_inside ? "" : " style=dashed");
}

}  // namespace

void write_graph_dot(std::ostream& out, const Report& report) {
  out << "digraph callbacks {\n  rankdir=LR;\n  node [shape=box fontname=\"sans-serif\"];\n"
         "  edge [fontname=\"sans-serif\" fontsize=10];\n";
  write_processes(out, report);
  std::set<std::string> outside;
  for (const auto& edge : report.edges) {
    if (!edge.from) outside.insert(edge.topic);
  }
  for (const auto& topic : outside) {
    out << fmt::format("  {} [shape=ellipse label=\"{}\\npublished outside callbacks\"];\n",
                       topic_name(topic), escaped(topic));
  }
  for (const auto& edge : report.edges)
    write_edge(out, edge);
  out << "}\n";
}

}  // namespace cie::viewer_export
