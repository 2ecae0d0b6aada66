#include <cie/viewer_export/instance_writer.hpp>

#include "external_sorter.hpp"
#include "instance_rows.hpp"
#include "name_table.hpp"

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::ReleaseSource;

struct Row {
  Instance instance;       // its logical_id is a view and not kept
  std::uint32_t name = 0;  // of the logical id
};

// The contract's order, made total so that equal traces give equal files.
struct ByStart {
  bool operator()(const Row& a, const Row& b) const {
    const auto key = [](const Row& row) {
      return std::tuple(row.instance.start, row.instance.tid, row.instance.pid, row.name,
                        row.instance.seq);
    };
    return key(a) < key(b);
  }
};

// Without any sign of a release the start itself is the bound.
Cell release(const Instance& instance) {
  const bool is_start = instance.release_source == ReleaseSource::start;
  return !instance.release && is_start ? Cell(instance.start.ns) : cell(instance.release);
}

// The contract's columns, in its order.
constexpr std::array<Column, 17> kColumns{{{"logical_id", ColumnType::text},
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
                                           {"missed"}}};

std::array<Cell, kColumns.size()> cells_of(const Instance& i, std::string_view logical_id) {
  return {logical_id.empty() ? Cell() : Cell(logical_id),  // never registered
          i.pid,
          i.tid,
          i.seq,
          release(i),
          cell(i.wakeup),
          i.start.ns,
          cell(i.end),
          cell(i.cpu_start),
          cell(i.cpu_end),
          cell(i.execution),
          cell(i.preempted),
          cell(i.blocked),
          analysis::label(i.release_source),
          cell(i.waking),
          cell(i.wake_delay),
          std::int64_t{i.missed}};
}

}  // namespace

struct InstanceWriter::State {
  NameTable names;
  ExternalSorter<Row, ByStart> rows;
  analysis::Progress* progress = nullptr;
};

InstanceWriter::InstanceWriter(std::filesystem::path spill_directory, std::size_t rows_in_memory)
    : state_(new State{{}, {rows_in_memory, std::move(spill_directory)}, nullptr}) {}
InstanceWriter::~InstanceWriter() = default;

void InstanceWriter::on_instance(const Instance& instance) {
  Row row{instance, state_->names.number(instance.logical_id, instance.callback)};
  row.instance.logical_id = {};
  row.instance.preempted_by = {};
  state_->rows.add(row);
}

void InstanceWriter::show_progress(analysis::Progress* progress) { state_->progress = progress; }

void InstanceWriter::write(std::ostream& out, TableFormat format) {
  const auto writer = make_table(format, out, kColumns);
  InstanceRows::drain(*this, *writer);
  writer->finish();
}

std::span<const Column> InstanceRows::columns() { return kColumns; }

void InstanceRows::drain(InstanceWriter& instances, TableWriter& table) {
  auto& state = *instances.state_;
  if (state.progress != nullptr) state.progress->total = state.rows.size();
  state.rows.drain([&](const Row& row) {
    table.row(cells_of(row.instance, state.names.name(row.name)));
    if (state.progress != nullptr) state.progress->add(1);
  });
}

}  // namespace cie::viewer_export
