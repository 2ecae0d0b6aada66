#include <cie/viewer_export/instance_writer.hpp>

#include "csv.hpp"
#include "external_sorter.hpp"
#include "json.hpp"
#include "name_table.hpp"

#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::Duration;
using analysis::Instance;
using analysis::ReleaseSource;
using analysis::Timestamp;

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

using Value = std::optional<std::int64_t>;

Value value(const std::optional<Timestamp>& time) { return time ? Value(time->ns) : Value(); }
Value value(const std::optional<Duration>& time) { return time ? Value(time->ns) : Value(); }
Value value(const std::optional<std::int32_t>& cpu) { return cpu ? Value(*cpu) : Value(); }

// Without any sign of a release the start itself is the bound.
Value release(const Instance& instance) {
  const bool is_start = instance.release_source == ReleaseSource::start;
  return !instance.release && is_start ? Value(instance.start.ns) : value(instance.release);
}

// The columns after logical_id, pid, tid and seq, in the contract's order.
constexpr std::array<std::string_view, 9> kTimes{"release_ns",   "wakeup_ns",    "start_ns",
                                                 "end_ns",       "cpu_start",    "cpu_end",
                                                 "execution_ns", "preempted_ns", "blocked_ns"};
std::array<Value, 9> times(const Instance& i) {
  return {release(i),         value(i.wakeup),    i.start.ns,
          value(i.end),       value(i.cpu_start), value(i.cpu_end),
          value(i.execution), value(i.preempted), value(i.blocked)};
}

void append_csv(std::string& out, const Row& row, std::string_view id) {
  const auto& i = row.instance;
  const auto append = [&](const Value& v) {
    if (v) {
      out += fmt::format_int(*v).c_str();
    }
    out += ',';
  };
  fmt::format_to(std::back_inserter(out), "{},{},{},{},", id, i.pid, i.tid, i.seq);
  for (const auto& v : times(i)) {
    append(v);
  }
  out += analysis::label(i.release_source);
  out += ',';
  append(value(i.waking));
  append(value(i.wake_delay));
  fmt::format_to(std::back_inserter(out), "{}\n", i.missed);
}

void append_json(std::string& out, const Row& row, std::string_view id) {
  const auto& i = row.instance;
  const auto append = [&](std::string_view name, const Value& v) {
    fmt::format_to(std::back_inserter(out), ",\"{}\":", name);
    out += v ? fmt::format_int(*v).c_str() : "null";
  };
  fmt::format_to(std::back_inserter(out), "{{\"logical_id\":{},\"pid\":{},\"tid\":{},\"seq\":{}",
                 id, i.pid, i.tid, i.seq);
  const auto values = times(i);
  for (std::size_t k = 0; k < values.size(); ++k) {
    append(kTimes.at(k), values.at(k));
  }
  fmt::format_to(std::back_inserter(out), ",\"release_source\":\"{}\"",
                 analysis::label(i.release_source));
  append("waking_ns", value(i.waking));
  append("wake_delay_ns", value(i.wake_delay));
  append("missed", i.missed);
  out += "}\n";
}

}  // namespace

struct InstanceWriter::State {
  NameTable names;
  ExternalSorter<Row, ByStart> rows;
};

InstanceWriter::InstanceWriter(std::filesystem::path spill_directory, std::size_t rows_in_memory)
    : state_(new State{{}, {rows_in_memory, std::move(spill_directory)}}) {}
InstanceWriter::~InstanceWriter() = default;

void InstanceWriter::on_instance(const Instance& instance) {
  Row row{instance, state_->names.number(instance.logical_id)};
  row.instance.logical_id = {};
  state_->rows.add(row);
}

void InstanceWriter::write(std::ostream& out, InstanceFormat format) {
  const bool is_csv = format == InstanceFormat::csv;
  std::vector<std::string> ids;
  for (std::uint32_t i = 0; i < state_->names.size(); ++i) {
    const auto& name = state_->names.name(i);
    ids.push_back(is_csv ? csv_field(name) : json_string(name));
  }
  if (is_csv) {
    out << "logical_id,pid,tid,seq,release_ns,wakeup_ns,start_ns,end_ns,cpu_start,cpu_end,"
           "execution_ns,preempted_ns,blocked_ns,release_source,waking_ns,wake_delay_ns,missed\n";
  }
  std::string line;
  state_->rows.drain([&](const Row& row) {
    line.clear();
    (is_csv ? append_csv : append_json)(line, row, ids.at(row.name));
    out.write(line.data(), static_cast<std::streamsize>(line.size()));
  });
}

}  // namespace cie::viewer_export
