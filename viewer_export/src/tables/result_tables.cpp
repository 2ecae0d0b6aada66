#include "result_tables.hpp"

#include <cie/analysis/report_fields.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/tables.hpp>

#include "words/verify_words.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Rare;
using analysis::Report;
using analysis::ReportRows;
using analysis::Summary;
using analysis::VerdictReport;
using Consume = ResultTable::Consume;

// Of a callback at an end of an edge; all NULL if there is none.
struct EndCells {
  Cell logical_id{};
  Cell pid{};
  Cell host{};

  static EndCells of(const ReportRows& rows, std::optional<analysis::CallbackIndex> index) {
    const auto* callback = index ? rows.find(*index) : nullptr;
    if (callback == nullptr) return {};
    const auto& process = rows.process_of(*callback);
    return {.logical_id = std::string_view(callback->logical_id),
            .pid = process.pid,
            .host = std::string_view(process.host)};
  }
};

// Of a chain; NULL if it spans processes, or never ran.
struct PlaceCells {
  Cell pid{};
  Cell host{};

  static PlaceCells of(const ReportRows& rows, std::optional<analysis::ProcessIndex> index) {
    if (!index) return {};
    const auto& process = rows.process(*index);
    return {.pid = process.pid, .host = std::string_view(process.host)};
  }
};

// --- statistics: nine columns each ---------------------------------------------------------------

const Summary kNoSummary{};

// Names of columns that are put together; they live as long as the program.
std::string_view kept(std::string name) {
  static std::vector<std::unique_ptr<std::string>> names;
  return *names.emplace_back(std::make_unique<std::string>(std::move(name)));
}

void add_summary_columns(std::vector<Column>& columns, std::string_view quantity) {
  const auto add = [&]<typename T>(const char* part, const T&) {
    columns.push_back({kept(fmt::format("{}_{}", quantity, part)),
                       std::is_floating_point_v<T> ? ColumnType::real : ColumnType::integer});
  };
  fields(add, kNoSummary);
}

void add_summary(std::vector<Cell>& cells, const Rare<Summary>& s) {
  const auto add = [&]<typename T>(const char*, const T& value) {
    if (!s) {
      cells.emplace_back();
    } else if constexpr (std::is_unsigned_v<T>) {
      cells.emplace_back(as_integer(value));
    } else {
      cells.emplace_back(value);
    }
  };
  fields(add, s ? *s : kNoSummary);
}

std::vector<Column> with_summaries(std::vector<Column> columns,
                                   std::initializer_list<std::string_view> quantities) {
  for (const std::string_view quantity : quantities)
    add_summary_columns(columns, quantity);
  return columns;
}

std::vector<Column> with_clock_error(std::vector<Column> columns) {
  columns.push_back({"clock_error_min_ns"});
  columns.push_back({"clock_error_max_ns"});
  return columns;
}

// Columns that came later stand last.
std::vector<Column> with(std::initializer_list<Column> more, std::vector<Column> columns) {
  columns.insert(columns.end(), more);
  return columns;
}

// NULL within one host, and where nothing bounds it.
void add_clock_error(std::vector<Cell>& cells, const std::optional<analysis::ClockError>& error) {
  const auto bound = [&error](auto which) {
    return error && (*error).*which ? Cell(((*error).*which)->ns) : Cell();
  };
  cells.push_back(bound(&analysis::ClockError::least));
  cells.push_back(bound(&analysis::ClockError::most));
}

// --- the tables -----------------------------------------------------------------------

constexpr ColumnType kText = ColumnType::text;
constexpr ColumnType kFlag = ColumnType::boolean;

ResultTable callbacks() {
  ResultTable table{.name = "callbacks",
                    .columns = {{"logical_id", kText},
                                {"pid", ColumnType::integer},
                                {"node", kText},
                                {"kind", kText},
                                {"source", kText},
                                {"symbol", kText},
                                {"period_ns"},
                                {"group"},
                                {"tids", kText},
                                {"isolated", kFlag},
                                {"instances"},
                                {"incomplete"},
                                {"missed_releases"},
                                {"release_source", kText}},
                    .rows = {}};
  for (const auto quantity : callback_quantities())
    add_summary_columns(table.columns, quantity);
  for (const std::string_view added :
       {"deadline_ns", "exceptions", "longest_queue", "response_deadline_ns", "late"})
    table.columns.push_back({added});
  table.columns.push_back({"isolation", kText});
  table.columns.push_back({"host", kText});
  table.columns.push_back({"callback_index"});
  table.columns.push_back({"process_index"});
  table.rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
    const ReportRows rows(report);
    for (const auto& c : report.callbacks) {
      const auto& process = rows.process_of(c);
      std::vector<std::int64_t> numbers;
      for (const auto& thread : c.threads)
        numbers.push_back(thread.tid);
      const std::string tids = fmt::format("{}", fmt::join(numbers, " "));
      std::vector<Cell> cells{c.logical_id,
                              process.pid,
                              c.node,
                              c.kind ? label(*c.kind) : std::string_view(),
                              c.source,
                              c.symbol,
                              cell(c.period_ns),
                              cell(c.group),
                              tids,
                              c.is_isolated(),
                              as_integer(c.instances),
                              as_integer(c.incomplete),
                              cell(c.missed_releases),
                              c.release_source ? Cell(analysis::label(*c.release_source)) : Cell()};
      const auto add = [&cells](const char*, const auto& summary) { add_summary(cells, summary); };
      quantities(add, c);
      for (const auto& added : {c.deadline_ns, c.exceptions, c.longest_queue})
        cells.push_back(cell(added));
      cells.push_back(cell(c.response_deadline));
      cells.push_back(cell(c.late));
      cells.push_back(c.isolation ? Cell(analysis::label(*c.isolation)) : Cell());
      cells.emplace_back(std::string_view(process.host));
      cells.push_back(index_cell(c.index));
      cells.push_back(index_cell(c.process));
      consume(cells, c.process);
    }
  };
  return table;
}

ResultTable callback_threads() {
  return {
      .name = "callback_threads",
      .columns = {{"logical_id", kText},
                  {"pid"},
                  {"tid"},
                  {"thread", kText},
                  {"instances"},
                  {"host", kText},
                  {"callback_index"},
                  {"thread_index"}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        const ReportRows rows(report);
        for (const auto& c : report.callbacks) {
          const auto& process = rows.process_of(c);
          for (const auto& thread : c.threads) {
            consume(std::array<Cell, 8>{c.logical_id, process.pid, thread.tid, thread.name,
                                        as_integer(thread.instances), process.host,
                                        index_cell(c.index), index_cell(thread.thread)},
                    c.process);
          }
        }
      }};
}

ResultTable threads() {
  return {
      .name = "threads",
      .columns = {{"pid"},          {"tid"},          {"name", kText},   {"role", kText},
                  {"callbacks"},    {"busy_ns"},      {"moment", kText}, {"policy", kText},
                  {"priority"},     {"nice"},         {"runtime_ns"},    {"deadline_ns"},
                  {"period_ns"},    {"cpus", kText},  {"flags"},         {"error"},
                  {"slice_ns"},     {"util_min"},     {"util_max"},      {"host", kText},
                  {"thread_index"}, {"process_index"}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        const ReportRows rows(report);
        for (const auto& t : report.threads) {
          const auto& process = rows.process_of(t);
          std::vector<Cell> cells{process.pid,
                                  t.tid,
                                  t.name,
                                  t.role ? Cell(label(*t.role)) : Cell(),
                                  as_integer(t.callbacks.size()),
                                  cell(t.busy_ns)};
          std::string cpus;
          std::string policy;
          if (const auto& s = t.sched) {
            cpus = fmt::format("{}", fmt::join(s->cpus, " "));
            policy = s->policy_name.empty() ? std::to_string(s->policy) : s->policy_name;
            cells.insert(
                cells.end(),
                {s->moment ? label(*s->moment) : std::string_view(), policy,
                 as_integer(s->priority), std::int64_t{s->nice}, as_integer(s->runtime_ns),
                 as_integer(s->deadline_ns), as_integer(s->period_ns), cpus, as_integer(s->flags),
                 std::int64_t{s->error}, cell(s->slice_ns), cell(s->util_min), cell(s->util_max)});
          } else {
            cells.resize(19);
          }
          cells.emplace_back(std::string_view(process.host));
          cells.push_back(index_cell(t.index));
          cells.push_back(index_cell(t.process));
          consume(cells, t.process);
        }
      }};
}

ResultTable processes() {
  return {
      .name = "processes",
      .columns = {{"host", kText},
                  {"pid"},
                  {"name", kText},
                  {"executor", kText},
                  {"complete", kFlag},
                  {"process_index"}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& p : report.processes) {
          consume(std::array<Cell, 6>{p.host, p.pid, p.name, cell(p.executor), p.complete,
                                      index_cell(p.index)},
                  p.index);
        }
      }};
}

ResultTable edges() {
  return {
      .name = "edges",
      .columns = with_summaries(with({{"from_host", kText},
                                      {"to_host", kText},
                                      {"from_callback_index"},
                                      {"to_callback_index"}},
                                     with_clock_error(with_summaries({{"from_logical_id", kText},
                                                                      {"from_pid"},
                                                                      {"to_logical_id", kText},
                                                                      {"to_pid"},
                                                                      {"topic", kText},
                                                                      {"messages"}},
                                                                     {"communication_ns"}))),
                                {"publish_to_start_ns"}),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        const ReportRows rows(report);
        for (const auto& e : report.edges) {
          const auto from = EndCells::of(rows, e.from);
          const auto to = EndCells::of(rows, e.to);
          std::vector<Cell> cells{from.logical_id, from.pid, to.logical_id,
                                  to.pid,          e.topic,  as_integer(e.messages)};
          add_summary(cells, e.communication);
          add_clock_error(cells, e.clock_error);
          cells.push_back(from.host);
          cells.push_back(to.host);
          cells.push_back(cell(e.from));
          cells.push_back(index_cell(e.to));
          add_summary(cells, e.publish_to_start);
          consume(cells, {});
        }
      }};
}

ResultTable chains() {
  return {
      .name = "chains",
      .columns = with_summaries(
          with({{"host", kText}, {"chain_index"}},
               with_clock_error(with_summaries(
                   {{"name", kText}, {"pid"}, {"hops"}, {"instances"}},
                   {"path_latency_ns", "reaction_time_ns", "data_age_ns", "undivided_ns"}))),
          {"from_start_ns", "path_latency_upper_ns", "response_ns"}),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        const ReportRows rows(report);
        for (const auto& c : report.chains) {
          const auto place = PlaceCells::of(rows, c.process);
          std::vector<Cell> cells{c.name, place.pid, as_integer(c.hops.size()),
                                  as_integer(c.instances)};
          add_summary(cells, c.path_latency);
          add_summary(cells, c.reaction_time);
          add_summary(cells, c.data_age);
          add_summary(cells, c.undivided);
          add_clock_error(cells, c.clock_error);
          cells.push_back(place.host);
          cells.push_back(index_cell(c.index));
          add_summary(cells, c.from_start);
          add_summary(cells, c.path_latency_upper);
          add_summary(cells, c.response);
          consume(cells, c.process);
        }
      }};
}

ResultTable chain_hops() {
  return {
      .name = "chain_hops",
      .columns = with_summaries(
          with({{"host", kText}, {"chain_index"}, {"from_callback_index"}, {"to_callback_index"}},
               with_clock_error(with_summaries({{"chain", kText},
                                                {"pid"},
                                                {"position"},
                                                {"from_logical_id", kText},
                                                {"to_logical_id", kText}},
                                               {"processing_ns", "communication_ns"}))),
          {"start_to_publish_ns", "publish_to_start_ns"}),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        const ReportRows rows(report);
        for (const auto& c : report.chains) {
          const auto place = PlaceCells::of(rows, c.process);
          std::int64_t position = 0;
          for (const auto& hop : c.hop_table) {
            std::vector<Cell> cells{c.name, place.pid, position++, hop.from, cell(hop.to)};
            add_summary(cells, hop.processing);
            add_summary(cells, hop.communication);
            add_clock_error(cells, hop.clock_error);
            cells.push_back(place.host);
            cells.push_back(index_cell(c.index));
            cells.push_back(cell(hop.from_callback));
            cells.push_back(cell(hop.to_callback));
            add_summary(cells, hop.start_to_publish);
            add_summary(cells, hop.publish_to_start);
            consume(cells, c.process);
          }
        }
      }};
}

ResultTable verdicts() {
  return {
      .name = "verdicts",
      .columns = {{"rule", kText},
                  {"name", kText},
                  {"subject", kText},
                  {"verdict", kText},
                  {"suppressed", kFlag},
                  {"checked"},
                  {"evidence"},
                  {"first_time_ns"},
                  {"first_note", kText},
                  {"subject_kind", kText},
                  {"subject_index"},
                  {"process_index"}},
      .rows = [](const Report& /*report*/, const VerdictReport& verdicts, const Consume& consume) {
        for (const auto& rule : verdicts.rules) {
          for (const auto& s : rule.subjects) {
            const bool has_evidence = !s.evidence.empty();
            const auto message = has_evidence ? message_of(rule, s) : std::string();
            consume(
                std::array<Cell, 12>{
                    rule.id, rule.name, s.subject, analysis::label(s.verdict), s.is_suppressed(),
                    as_integer(s.checked), as_integer(s.evidence.size()),
                    has_evidence && s.evidence.front().time ? Cell(s.evidence.front().time->ns)
                                                            : Cell(),
                    has_evidence ? Cell(std::string_view(message)) : Cell(),
                    analysis::label(s.about.kind), cell(s.about.index), cell(s.about.process)},
                {});
          }
        }
      }};
}

ResultTable losses() {
  return {
      .name = "losses",
      .columns = {{"kind", kText}, {"severity", kText}, {"count"}, {"advice", kText}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& d : report.defects) {
          consume(std::array<Cell, 4>{analysis::label(d.kind), analysis::label(d.severity),
                                      as_integer(d.count), d.advice},
                  {});
        }
      }};
}

}  // namespace

const std::vector<std::string_view>& callback_quantities() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    const auto add = [&all](const char* name, const auto&) { all.emplace_back(name); };
    const analysis::CallbackReport any;
    quantities(add, any);
    return all;
  }();
  return names;
}

const std::vector<ResultTable>& result_tables() {
  static const std::vector<ResultTable> tables{
      callbacks(), callback_threads(), threads(),  processes(), edges(),
      chains(),    chain_hops(),       verdicts(), losses()};
  return tables;
}

const std::vector<std::string>& table_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all{"instances"};
    for (const ResultTable& table : result_tables())
      all.push_back(table.name);
    return all;
  }();
  return names;
}

void write_table(std::ostream& out, std::string_view name, TableFormat format,
                 const analysis::AnalysisResult& result) {
  for (const ResultTable& table : result_tables()) {
    if (table.name != name) continue;
    const auto writer = make_table(format, out, table.columns);
    table.rows(result.report, result.verdicts,
               [&writer](std::span<const Cell> cells, const auto&) { writer->row(cells); });
    writer->finish();
    return;
  }
  throw std::invalid_argument("there is no table " + std::string(name));
}

void write_report_csv(std::ostream& out, const Report& report) {
  const ResultTable& table = result_tables().front();
  const auto writer = make_csv_table(out, table.columns);
  table.rows(report, {},
             [&writer](std::span<const Cell> cells, const auto&) { writer->row(cells); });
  writer->finish();
}

}  // namespace cie::viewer_export
