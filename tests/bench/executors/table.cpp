#include "table.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>
#include <tuple>

namespace bench {
namespace {

const char* name_of(Placement placement) {
  return placement == Placement::intra ? "intra" : "inter";
}
const char* name_of(Phases phases) { return phases == Phases::aligned ? "aligned" : "staggered"; }
const char* policy_of(const Workload& workload) {
  return workload.fifo_priority > 0 ? "fifo" : "other";
}

const char* name_of(Passing passing) {
  switch (passing) {
    case Passing::copy:
      return "copy";
    case Passing::pointer:
      return "pointer";
    case Passing::shared:
      return "shared";
    default:
      return "serialized";
  }
}

void print_cell(std::optional<double> value) {
  if (value) {
    std::printf(" %9.2f", *value);
  } else {
    std::printf(" %9s", "-");
  }
}

std::string optional_text(const std::optional<std::uint64_t>& value) {
  return value ? std::to_string(*value) : std::string{};
}

std::optional<double> ratio(std::optional<double> a, std::optional<double> b) {
  if (!a || !b || *b == 0) return std::nullopt;
  return *a / *b;
}

// What rows of different executors have in common when they are compared.
auto conditions(const Workload& w) {
  return std::tuple{w.fifo_priority, w.placement, w.phases, w.payload, w.passing, w.pairs};
}

void print_ratios_of(const Row& isolated, const std::map<std::string, const Row*>& others,
                     const std::vector<std::string>& names) {
  const auto& w = isolated.workload;
  std::printf("%-6s %-5s %-9s %5u", policy_of(w), name_of(w.placement), name_of(w.phases), w.pairs);
  const auto calls = isolated.measured.per_message(isolated.measured.counts.system_calls);
  const auto switches = isolated.measured.per_message(isolated.measured.counts.context_switches);
  for (const auto& name : names) {
    const auto found = others.find(name);
    if (found == others.end()) {
      std::printf(" %9s %9s", "-", "-");
      continue;
    }
    const auto& other = found->second->measured;
    print_cell(ratio(calls, other.per_message(other.counts.system_calls)));
    print_cell(ratio(switches, other.per_message(other.counts.context_switches)));
  }
  std::printf("\n");
}

}  // namespace

void print_head() {
  std::printf("%-16s %-6s %-5s %-9s %8s %-10s %3s %9s %9s %9s %9s %9s %9s %9s\n", "executor",
              "policy", "path", "phases", "bytes", "passing", "N", "messages", "calls/msg",
              "ctxsw/msg", "cpu us", "pss KiB", "p50 us", "p99 us");
}

void print(const Row& row) {
  const auto& w = row.workload;
  const auto& m = row.measured;
  std::printf("%-16s %-6s %-5s %-9s %8u %-10s %3u %9llu", w.executor.c_str(), policy_of(w),
              name_of(w.placement), name_of(w.phases), w.payload, name_of(w.passing), w.pairs,
              static_cast<unsigned long long>(m.messages));
  print_cell(m.per_message(m.counts.system_calls));
  print_cell(m.per_message(m.counts.context_switches));
  print_cell(m.per_message(m.counts.cpu_ns / 1000));
  std::printf(" %9s %9.1f %9.1f\n", m.pss_kib ? optional_text(m.pss_kib).c_str() : "-",
              m.latency_p50_us, m.latency_p99_us);
  std::fflush(stdout);
}

CsvFile::CsvFile(const std::string& path) : file_(path) {
  file_ << "executor,policy,path,phases,payload_bytes,passing,pairs,seconds,messages,system_calls,"
           "context_switches,cpu_ns,pss_kib,latency_mean_us,latency_p50_us,latency_p99_us\n";
  if (!file_.flush()) throw std::runtime_error{"cannot write \"" + path + '"'};
}

void CsvFile::write(const Row& row) {
  const auto& w = row.workload;
  const auto& m = row.measured;
  file_ << w.executor << ',' << policy_of(w) << ',' << name_of(w.placement) << ','
        << name_of(w.phases) << ',' << w.payload << ',' << name_of(w.passing) << ',' << w.pairs
        << ',' << m.seconds << ',' << m.messages << ',' << optional_text(m.counts.system_calls)
        << ',' << optional_text(m.counts.context_switches) << ',' << m.counts.cpu_ns << ','
        << optional_text(m.pss_kib) << ',' << m.latency_mean_us << ',' << m.latency_p50_us << ','
        << m.latency_p99_us << '\n';
  if (!file_.flush()) throw std::runtime_error{"cannot write the file of all numbers"};
}

void print_ratios(const std::vector<Row>& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) {
    const auto& name = row.workload.executor;
    if (name != "isolated" && std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  if (names.empty()) return;
  std::printf("\nisolated as a multiple of (system calls, context switches)\n");
  std::printf("%-6s %-5s %-9s %5s", "policy", "path", "phases", "N");
  for (const auto& name : names)
    std::printf(" %19s", name.c_str());
  std::printf("\n");
  for (const auto& isolated : rows) {
    if (isolated.workload.executor != "isolated") continue;
    std::map<std::string, const Row*> others;
    for (const auto& row : rows) {
      if (conditions(row.workload) == conditions(isolated.workload))
        others.emplace(row.workload.executor, &row);
    }
    print_ratios_of(isolated, others, names);
  }
}

}  // namespace bench
