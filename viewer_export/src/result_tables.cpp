#include "result_tables.hpp"

#include <cie/viewer_export/report_writers.hpp>
#include <cie/viewer_export/tables.hpp>

#include <array>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::viewer_export {
namespace {

using analysis::Report;
using analysis::Summary;
using analysis::VerdictReport;
using Consume = ResultTable::Consume;

// Of a callback, a thread or a process.
template <typename Subject>
ProcessKey key_of(const Subject& subject) {
  return {.host = subject.host_number, .pid = subject.pid};
}

std::int64_t as_integer(std::uint64_t value) { return static_cast<std::int64_t>(value); }

// --- statistics: nine columns each
// ----------------------------------------------------------------

// Names of columns that are put together; they live as long as the program.
std::string_view kept(std::string name) {
  static std::vector<std::unique_ptr<std::string>> names;
  return *names.emplace_back(std::make_unique<std::string>(std::move(name)));
}

void add_summary_columns(std::vector<Column>& columns, std::string_view quantity) {
  for (const std::string_view part :
       {"count", "min", "max", "sum", "mean", "p50", "p90", "p99", "p99_9"}) {
    columns.push_back({kept(fmt::format("{}_{}", quantity, part)),
                       part == "mean" ? ColumnType::real : ColumnType::integer});
  }
}

void add_summary(std::vector<Cell>& cells, const std::optional<Summary>& s) {
  if (!s) {
    cells.resize(cells.size() + 9);
    return;
  }
  cells.insert(cells.end(), {as_integer(s->count), s->min, s->max, s->sum, s->mean, s->p50, s->p90,
                             s->p99, s->p99_9});
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

// NULL within one host, and where nothing bounds it.
void add_clock_error(std::vector<Cell>& cells, const std::optional<analysis::ClockError>& error) {
  const auto bound = [&error](auto which) {
    return error && (*error).*which ? Cell(((*error).*which)->ns) : Cell();
  };
  cells.push_back(bound(&analysis::ClockError::least));
  cells.push_back(bound(&analysis::ClockError::most));
}

// --- the tables
// -----------------------------------------------------------------------------------

constexpr ColumnType text = ColumnType::text;
constexpr ColumnType boolean = ColumnType::boolean;

constexpr std::array<Quantity, 11> kQuantities{{
    {"response_time_ns", &analysis::CallbackReport::response_time},
    {"response_time_lower_ns", &analysis::CallbackReport::response_time_lower},
    {"response_time_upper_ns", &analysis::CallbackReport::response_time_upper},
    {"start_latency_ns", &analysis::CallbackReport::start_latency},
    {"duration_ns", &analysis::CallbackReport::duration},
    {"inter_arrival_ns", &analysis::CallbackReport::inter_arrival},
    {"execution_time_ns", &analysis::CallbackReport::execution_time},
    {"preempted_ns", &analysis::CallbackReport::preempted},
    {"blocked_ns", &analysis::CallbackReport::blocked},
    {"wake_delay_ns", &analysis::CallbackReport::wake_delay},
    {"wakeup_latency_ns", &analysis::CallbackReport::wakeup_latency},
}};

ResultTable callbacks() {
  ResultTable table{.name = "callbacks",
                    .columns = {{"logical_id", text},
                                {"pid", ColumnType::integer},
                                {"node", text},
                                {"kind", text},
                                {"source", text},
                                {"symbol", text},
                                {"period_ns"},
                                {"group"},
                                {"tids", text},
                                {"isolated", boolean},
                                {"instances"},
                                {"incomplete"},
                                {"missed_releases"},
                                {"release_source", text}},
                    .rows = {}};
  for (const Quantity& quantity : kQuantities)
    add_summary_columns(table.columns, quantity.name);
  table.columns.push_back({"deadline_ns"});
  table.rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
    for (const auto& c : report.callbacks) {
      std::vector<std::int64_t> numbers;
      for (const auto& thread : c.threads)
        numbers.push_back(thread.tid);
      const std::string tids = fmt::format("{}", fmt::join(numbers, " "));
      std::vector<Cell> cells{c.logical_id,
                              c.pid,
                              c.node,
                              c.kind,
                              c.source,
                              c.symbol,
                              cell(c.period_ns),
                              cell(c.group),
                              tids,
                              c.isolated,
                              as_integer(c.instances),
                              as_integer(c.incomplete),
                              cell(c.missed_releases),
                              c.release_source ? Cell(analysis::label(*c.release_source)) : Cell()};
      for (const Quantity& quantity : kQuantities)
        add_summary(cells, c.*(quantity.summary));
      cells.push_back(cell(c.deadline_ns));
      consume(cells, key_of(c));
    }
  };
  return table;
}

ResultTable callback_threads() {
  return {
      .name = "callback_threads",
      .columns = {{"logical_id", text}, {"pid"}, {"tid"}, {"thread", text}, {"instances"}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& c : report.callbacks)
          for (const auto& thread : c.threads)
            consume(std::array<Cell, 5>{c.logical_id, c.pid, thread.tid, thread.name,
                                        as_integer(thread.instances)},
                    key_of(c));
      }};
}

ResultTable threads() {
  return {
      .name = "threads",
      .columns = {{"pid"},
                  {"tid"},
                  {"name", text},
                  {"role", text},
                  {"callbacks"},
                  {"busy_ns"},
                  {"moment", text},
                  {"policy", text},
                  {"priority"},
                  {"nice"},
                  {"runtime_ns"},
                  {"deadline_ns"},
                  {"period_ns"},
                  {"cpus", text},
                  {"flags"},
                  {"error"},
                  {"slice_ns"},
                  {"util_min"},
                  {"util_max"}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& t : report.threads) {
          std::vector<Cell> cells{
              t.pid, t.tid, t.name, cell(t.role), as_integer(t.callbacks.size()), cell(t.busy_ns)};
          std::string cpus;
          std::string policy;
          if (const auto& s = t.sched) {
            cpus = fmt::format("{}", fmt::join(s->cpus, " "));
            policy = s->policy_name.empty() ? std::to_string(s->policy) : s->policy_name;
            cells.insert(cells.end(), {s->moment, policy, as_integer(s->priority),
                                       std::int64_t{s->nice}, as_integer(s->runtime_ns),
                                       as_integer(s->deadline_ns), as_integer(s->period_ns), cpus,
                                       as_integer(s->flags), std::int64_t{s->error},
                                       cell(s->slice_ns), cell(s->util_min), cell(s->util_max)});
          } else {
            cells.resize(19);
          }
          consume(cells, key_of(t));
        }
      }};
}

ResultTable processes() {
  return {
      .name = "processes",
      .columns =
          {{"host", text}, {"pid"}, {"name", text}, {"executor", text}, {"complete", boolean}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& p : report.processes)
          consume(std::array<Cell, 5>{p.host, p.pid, p.name, cell(p.executor), p.complete},
                  key_of(p));
      }};
}

ResultTable edges() {
  return {
      .name = "edges",
      .columns = with_clock_error(with_summaries({{"from_logical_id", text},
                                                  {"from_pid"},
                                                  {"to_logical_id", text},
                                                  {"to_pid"},
                                                  {"topic", text},
                                                  {"messages"}},
                                                 {"communication_ns"})),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& e : report.edges) {
          std::vector<Cell> cells{e.from ? Cell(std::string_view(e.from->logical_id)) : Cell(),
                                  e.from ? Cell(e.from->pid) : Cell(),
                                  e.to.logical_id,
                                  e.to.pid,
                                  e.topic,
                                  as_integer(e.messages)};
          add_summary(cells, e.communication);
          add_clock_error(cells, e.clock_error);
          consume(cells, {});
        }
      }};
}

ResultTable chains() {
  return {
      .name = "chains",
      .columns =
          with_clock_error(with_summaries({{"name", text}, {"pid"}, {"hops"}, {"instances"}},
                                          {"path_latency_ns", "reaction_time_ns", "data_age_ns"})),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& c : report.chains) {
          std::vector<Cell> cells{c.name, cell(c.pid), as_integer(c.hops.size()),
                                  as_integer(c.instances)};
          add_summary(cells, c.path_latency);
          add_summary(cells, c.reaction_time);
          add_summary(cells, c.data_age);
          add_clock_error(cells, c.clock_error);
          consume(cells, {});
        }
      }};
}

ResultTable chain_hops() {
  return {
      .name = "chain_hops",
      .columns = with_clock_error(with_summaries({{"chain", text},
                                                  {"pid"},
                                                  {"position"},
                                                  {"from_logical_id", text},
                                                  {"to_logical_id", text}},
                                                 {"processing_ns", "communication_ns"})),
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& c : report.chains) {
          std::int64_t position = 0;
          for (const auto& hop : c.hop_table) {
            std::vector<Cell> cells{c.name, cell(c.pid), position++, hop.from, cell(hop.to)};
            add_summary(cells, hop.processing);
            add_summary(cells, hop.communication);
            add_clock_error(cells, hop.clock_error);
            consume(cells, {});
          }
        }
      }};
}

ResultTable verdicts() {
  return {
      .name = "verdicts",
      .columns = {{"rule", text},
                  {"name", text},
                  {"subject", text},
                  {"verdict", text},
                  {"suppressed", boolean},
                  {"checked"},
                  {"evidence"},
                  {"first_time_ns"},
                  {"first_note", text}},
      .rows = [](const Report& /*report*/, const VerdictReport& verdicts, const Consume& consume) {
        for (const auto& rule : verdicts.rules)
          for (const auto& s : rule.subjects) {
            const bool has_evidence = !s.evidence.empty();
            consume(
                std::array<Cell, 9>{
                    rule.id, rule.name, s.subject, analysis::label(s.verdict), s.is_suppressed(),
                    as_integer(s.checked), as_integer(s.evidence.size()),
                    has_evidence ? Cell(s.evidence.front().time.ns) : Cell(),
                    has_evidence ? Cell(std::string_view(s.evidence.front().note)) : Cell()},
                {});
          }
      }};
}

ResultTable losses() {
  return {
      .name = "losses",
      .columns = {{"kind", text}, {"severity", text}, {"count"}, {"advice", text}},
      .rows = [](const Report& report, const VerdictReport& /*verdicts*/, const Consume& consume) {
        for (const auto& d : report.defects)
          consume(std::array<Cell, 4>{d.kind, analysis::label(d.severity), as_integer(d.count),
                                      d.advice},
                  {});
      }};
}

}  // namespace

std::span<const Quantity> callback_quantities() { return kQuantities; }

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
