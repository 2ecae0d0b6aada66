#include <cie/analysis/report_rows.hpp>
#include <cie/viewer_export/instance_writer.hpp>

#include "instance_rows.hpp"
#include "output/external_sorter.hpp"
#include "output/kept_instance.hpp"
#include "output/name_table.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace cie::viewer_export {
namespace {

using analysis::Instance;

// The contract's order, made total so that equal traces give equal files.
struct InOrder {
  InstanceOrder order;

  bool operator()(const KeptInstance& a, const KeptInstance& b) const {
    const auto key = [this](const KeptInstance& row) {
      const auto group =
          order == InstanceOrder::by_process ? row.process : analysis::ProcessIndex{};
      return std::tuple(group, row.start, row.tid, row.process, row.name, row.seq);
    };
    return key(a) < key(b);
  }
};

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

std::array<Cell, kColumns.size()> cells_of(const KeptInstance& row, std::string_view logical_id,
                                           const analysis::ProcessReport& process) {
  return {logical_id.empty() ? Cell() : Cell(logical_id),  // never registered
          process.pid,
          cell(known_tid(row.tid)),
          row.seq,
          cell(row.number(KeptInstance::release)),
          cell(row.number(KeptInstance::wakeup)),
          row.start,
          cell(row.number(KeptInstance::end)),
          cell(row.number(KeptInstance::cpu_start)),
          cell(row.number(KeptInstance::cpu_end)),
          cell(row.number(KeptInstance::execution)),
          cell(row.number(KeptInstance::preempted)),
          cell(row.number(KeptInstance::blocked)),
          analysis::label(row.release_source),
          cell(row.number(KeptInstance::waking)),
          cell(row.number(KeptInstance::wake_delay)),
          cell(row.number(KeptInstance::missed)),
          row.status ? Cell(label(*row.status)) : Cell(),
          std::string_view(process.host),
          index_cell(row.callback)};
}

}  // namespace

struct InstanceWriter::State {
  NameTable names;
  ExternalSorter<KeptInstance, InOrder> rows;
  analysis::Progress* progress = nullptr;

  template <typename Consume>
  void drain(Consume consume) {
    if (progress != nullptr) progress->total = rows.size();
    rows.drain([&](const KeptInstance& row) {
      consume(row);
      if (progress != nullptr) progress->add(1);
    });
  }
};

InstanceWriter::InstanceWriter(std::filesystem::path spill_directory, std::size_t rows_in_memory,
                               InstanceOrder order)
    : state_(new State{{}, {rows_in_memory, std::move(spill_directory), {order}}}) {}
InstanceWriter::~InstanceWriter() = default;

void InstanceWriter::on_instance(const Instance& instance) {
  auto row = KeptInstance::of(instance);
  row.name = state_->names.number(instance.logical_id, instance.callback);
  state_->rows.add(row);
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
  const TakenBackReleases taken_back(report);
  state.drain([&](const KeptInstance& told) {
    const auto row = taken_back.corrected(told);
    consume(cells_of(row, state.names.name(row.name), rows.process_of(row)), row.process,
            row.state == analysis::InstanceState::complete);
  });
}

}  // namespace cie::viewer_export
