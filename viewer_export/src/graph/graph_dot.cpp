#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/graph_writer.hpp>

#include "tables/report_tables.hpp"
#include "words/callback_names.hpp"
#include "words/text_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::GraphEdge;
using analysis::ProcessIndex;
using analysis::Report;
using analysis::ReportRows;

bool is_continued_at(std::string_view utf8, std::size_t byte) {
  return (static_cast<unsigned char>(utf8[byte]) & 0xC0U) == 0x80U;
}

// Of valid UTF-8: the middle of a long text becomes an ellipsis. Graphviz refuses strings of 16384
// bytes and more, and a box with a name that long shows nothing. elide() counts columns, of which
// combining characters take none.
std::string shortened(std::string text) {
  constexpr std::size_t kMost = 512;
  constexpr std::string_view kEllipsis = "\xE2\x80\xA6";
  if (text.size() <= kMost) return text;
  auto head = (kMost - kEllipsis.size()) / 2;
  auto tail = text.size() - head;
  while (is_continued_at(text, head))
    --head;
  while (is_continued_at(text, tail))
    ++tail;
  return text.replace(head, tail - head, kEllipsis);
}

// The inside of a quoted string; "\n" is DOT's own line break and comes from us alone.
std::string dot_escaped(std::string_view text) {
  std::string result;
  for (const char c : shortened(printable(text))) {
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result;
}

// Names and pids may be the same on several hosts, the callback's number is not.
std::string node_name(const ReportRows& rows, analysis::CallbackIndex callback) {
  const auto* row = rows.find(callback);
  return fmt::format("\"{} {}\"", at(callback), row != nullptr ? dot_escaped(row->logical_id) : "");
}

// What came from no callback of the recording.
struct Topic {
  std::size_t number = 0;
  std::uint64_t messages = 0;
  std::uint64_t unrecorded = 0;
};
using Topics = std::map<std::string, Topic>;

std::string origin_of(const Topic& topic) {
  if (topic.unrecorded == 0) return "published outside callbacks";
  if (topic.unrecorded == topic.messages) return "publishers not recorded";
  return fmt::format("{} published outside callbacks,\\n{} by publishers not recorded",
                     topic.messages - topic.unrecorded, topic.unrecorded);
}

// Two that are shortened may look alike.
std::string topic_name(const Topics& topics, const std::string& topic) {
  const auto whole = printable(topic);
  const bool is_whole = shortened(whole) == whole;
  const auto number = is_whole ? std::string() : std::to_string(topics.at(topic).number) + ' ';
  return fmt::format("\"topic {}{}\"", number, dot_escaped(topic));
}

std::string label_of(const CallbackReport& callback, const CallbackNames& names) {
  auto label = dot_escaped(names.of_id(callback.logical_id));
  if (analysis::longest_response(callback)) {
    label += fmt::format("\\nresponse p99 {}, max {}",
                         response_cell(callback, &analysis::Summary::p99, format_duration).text,
                         response_cell(callback, &analysis::Summary::max, format_duration).text);
  }
  return label;
}

std::string label_of(const Report& report, const analysis::ProcessReport& process) {
  auto label = process.name.empty() ? std::string() : process.name + ", ";
  label += pid_words(process);
  if (report.trace.hosts.size() > 1) label += " on " + process.host;
  return dot_escaped(label);
}

// Callbacks that no message links would only bury the others: Autoware has a thousand of them.
std::vector<const CallbackReport*> linked_callbacks(const Report& report) {
  std::set<analysis::CallbackIndex> linked;
  for (const auto& edge : report.edges) {
    if (edge.from) linked.insert(*edge.from);
    linked.insert(edge.to);
  }
  std::vector<const CallbackReport*> callbacks;
  for (const auto& callback : report.callbacks) {
    if (linked.contains(callback.index)) callbacks.push_back(&callback);
  }
  return callbacks;
}

void write_processes(std::ostream& out, const Report& report,
                     const std::vector<const CallbackReport*>& shown, const ReportRows& rows) {
  const CallbackNames names(report, {.unicode = true});
  std::map<ProcessIndex, std::vector<const CallbackReport*>> by_process;
  for (const auto* callback : shown)
    by_process[callback->process].push_back(callback);
  for (const auto& [process, callbacks] : by_process) {
    out << fmt::format("  subgraph \"cluster_{}\" {{\n    label=\"{}\";\n", at(process),
                       label_of(report, rows.process(process)));
    for (const auto* callback : callbacks) {
      out << fmt::format("    {} [label=\"{}\" tooltip=\"{}\"];\n",
                         node_name(rows, callback->index), label_of(*callback, names),
                         dot_escaped(callback->logical_id));
    }
    out << "  }\n";
  }
}

bool is_within_process(const ReportRows& rows, const GraphEdge& edge) {
  const auto* from = edge.from ? rows.find(*edge.from) : nullptr;
  const auto* to = rows.find(edge.to);
  return from != nullptr && to != nullptr && from->process == to->process;
}

void write_edge(std::ostream& out, const ReportRows& rows, const Topics& outside,
                const GraphEdge& edge) {
  auto label = fmt::format("{}\\n{}", dot_escaped(edge.topic), counted(edge.messages, "message"));
  if (const auto& latency = edge.communication) {
    label += fmt::format("\\nlatency p50 {}, max {}", format_duration(latency->p50),
                         format_duration(latency->max));
  }
  if (edge.clock_error) {
    label += fmt::format("\\nclocks: {}", format_clock_error(*edge.clock_error));
  }
  out << fmt::format("  {} -> {} [label=\"{}\"{}];\n",
                     edge.from ? node_name(rows, *edge.from) : topic_name(outside, edge.topic),
                     node_name(rows, edge.to), label,
                     is_within_process(rows, edge) ? "" : " style=dashed");
}

}  // namespace

void write_graph_dot(std::ostream& out, const Report& report) {
  out << "digraph callbacks {\n  rankdir=LR;\n  node [shape=box fontname=\"sans-serif\"];\n"
         "  edge [fontname=\"sans-serif\" fontsize=10];\n";
  const ReportRows rows(report);
  const auto shown = linked_callbacks(report);
  if (const auto left = report.callbacks.size() - shown.size(); left > 0) {
    out << fmt::format("  label=\"{} of {} not shown: no message links them to others\";\n", left,
                       counted(report.callbacks.size(), "callback"));
  }
  write_processes(out, report, shown, rows);
  Topics outside;
  for (const auto& edge : report.edges) {
    if (edge.from) continue;
    auto& topic = outside.try_emplace(edge.topic, Topic{.number = outside.size()}).first->second;
    topic.messages += edge.messages;
    topic.unrecorded += edge.unrecorded.value_or(0);
  }
  for (const auto& [name, topic] : outside) {
    out << fmt::format("  {} [shape=ellipse label=\"{}\\n{}\"];\n", topic_name(outside, name),
                       dot_escaped(name), origin_of(topic));
  }
  for (const auto& edge : report.edges)
    write_edge(out, rows, outside, edge);
  out << "}\n";
}

}  // namespace cie::viewer_export
