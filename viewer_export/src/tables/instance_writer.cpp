#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/instance_writer.hpp>

#include "instance_rows.hpp"
#include "output/external_sorter.hpp"
#include "output/name_table.hpp"
#include "output/optional_numbers.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::ReleaseSource;

// An instance as it is sorted and spilled: small.
struct Row {
  // What may be unknown.
  enum Number : std::uint8_t {
    release,
    wakeup,
    end,
    cpu_start,
    cpu_end,
    execution,
    preempted,
    blocked,
    waking,
    wake_delay
  };

  std::int64_t start = 0;
  std::int64_t tid = 0;
  analysis::CallbackIndex callback{};
  analysis::ProcessIndex process{};
  analysis::ProcessIndex group{};  // the process where rows are ordered by it, else 0
  std::uint32_t name = 0;          // of the logical id
  std::uint32_t missed = 0;
  std::uint64_t seq = 0;
  ReleaseSource release_source{};
  bool is_counted = false;
  std::optional<CallbackStatus> status{};
  OptionalNumbers<Number, wake_delay + 1> numbers{};

  Cell cell(Number number) const {
    return numbers.is_known(number) ? Cell(numbers.value(number)) : Cell();
  }
};

// The contract's order, made total so that equal traces give equal files.
struct InOrder {
  bool operator()(const Row& a, const Row& b) const {
    const auto key = [](const Row& row) {
      return std::tuple(row.group, row.start, row.tid, row.process, row.name, row.seq);
    };
    return key(a) < key(b);
  }
};

Row row_of(const Instance& i, std::uint32_t name, InstanceOrder order) {
  Row row{.start = i.start.ns,
          .tid = i.tid,
          .callback = i.callback,
          .process = i.process,
          .group = order == InstanceOrder::by_process ? i.process : analysis::ProcessIndex{},
          .name = name,
          .missed = i.missed,
          .seq = i.seq,
          .release_source = i.release_source,
          .is_counted = i.state == analysis::InstanceState::complete,
          .status = i.status};
  // Without any sign of a release the start itself is the bound.
  const bool is_start = i.release_source == ReleaseSource::start;
  row.numbers.keep(Row::release, !i.release && is_start ? std::optional(i.start) : i.release);
  row.numbers.keep(Row::wakeup, i.wakeup);
  row.numbers.keep(Row::end, i.end);
  row.numbers.keep(Row::cpu_start, i.cpu_start);
  row.numbers.keep(Row::cpu_end, i.cpu_end);
  row.numbers.keep(Row::execution, i.execution);
  row.numbers.keep(Row::preempted, i.preempted);
  row.numbers.keep(Row::blocked, i.blocked);
  row.numbers.keep(Row::waking, i.waking);
  row.numbers.keep(Row::wake_delay, i.wake_delay);
  return row;
}

// The contract's columns, in its order, and behind them the row of the report.
constexpr std::size_t kContractColumns = 19;
constexpr std::array<Column, kContractColumns + 1> kColumns{{{"logical_id", ColumnType::text},
                                                             {"pid"},
                                                             {"tid"},
                                                             {"seq"},
                                                             {"release_ns"},
                                                             {"wakeup_ns"},
                                                             {"start_ns"},
                                                             {"end_ns"},
                                                             {"cpu_start"},
                                                             {"cpu_end"},
                                                             {"execution_ns"},
                                                             {"preempted_ns"},
                                                             {"blocked_ns"},
                                                             {"release_source", ColumnType::text},
                                                             {"waking_ns"},
                                                             {"wake_delay_ns"},
                                                             {"missed"},
                                                             {"status", ColumnType::text},
                                                             {"host", ColumnType::text},
                                                             {"callback_index"}}};

std::array<Cell, kColumns.size()> cells_of(const Row& row, std::string_view logical_id,
                                           const analysis::ProcessReport& process) {
  return {logical_id.empty() ? Cell() : Cell(logical_id),  // never registered
          process.pid,
          row.tid,
          row.seq,
          row.cell(Row::release),
          row.cell(Row::wakeup),
          row.start,
          row.cell(Row::end),
          row.cell(Row::cpu_start),
          row.cell(Row::cpu_end),
          row.cell(Row::execution),
          row.cell(Row::preempted),
          row.cell(Row::blocked),
          analysis::label(row.release_source),
          row.cell(Row::waking),
          row.cell(Row::wake_delay),
          std::int64_t{row.missed},
          row.status ? Cell(label(*row.status)) : Cell(),
          std::string_view(process.host),
          index_cell(row.callback)};
}

}  // namespace

struct InstanceWriter::State {
  NameTable names;
  ExternalSorter<Row, InOrder> rows;
  InstanceOrder order;
  analysis::Progress* progress = nullptr;

  template <typename Consume>
  void drain(Consume consume) {
    if (progress != nullptr) progress->total = rows.size();
    rows.drain([&](const Row& row) {
      consume(row);
      if (progress != nullptr) progress->add(1);
    });
  }
};

InstanceWriter::InstanceWriter(std::filesystem::path spill_directory, std::size_t rows_in_memory,
                               InstanceOrder order)
    : state_(new State{{}, {rows_in_memory, std::move(spill_directory)}, order}) {}
InstanceWriter::~InstanceWriter() = default;

void InstanceWriter::on_instance(const Instance& instance) {
  state_->rows.add(row_of(instance, state_->names.number(instance.logical_id, instance.callback),
                          state_->order));
}

void InstanceWriter::show_progress(analysis::Progress* progress) { state_->progress = progress; }

void InstanceWriter::write(std::ostream& out, TableFormat format, const analysis::Report& report,
                           InstanceColumns columns) {
  const std::size_t count = columns == InstanceColumns::all ? kColumns.size() : kContractColumns;
  const auto writer = make_table(format, out, std::span(kColumns).first(count));
  InstanceRows::drain(*this, report, [&](std::span<const Cell> cells, const auto&, bool) {
    writer->row(cells.first(count));
  });
  writer->finish();
}

std::span<const Column> InstanceRows::columns() { return kColumns; }

void InstanceRows::drain(InstanceWriter& instances, TableWriter& table,
                         const analysis::Report& report) {
  drain(instances, report,
        [&table](std::span<const Cell> cells, const auto&, bool) { table.row(cells); });
}

void InstanceRows::drain(InstanceWriter& instances, const analysis::Report& report,
                         const Consume& consume) {
  auto& state = *instances.state_;
  const analysis::ReportRows rows(report);
  state.drain([&](const Row& row) {
    consume(cells_of(row, state.names.name(row.name), rows.process_of(row)), row.process,
            row.is_counted);
  });
}

}  // namespace cie::viewer_export
