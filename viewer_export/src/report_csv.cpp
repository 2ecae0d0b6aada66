#include <cie/viewer_export/report_writers.hpp>

#include "csv.hpp"

#include <array>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::Summary;

struct Quantity {
  std::string_view name;
  std::optional<Summary> CallbackReport::*summary;
};
constexpr std::array<Quantity, 11> kQuantities{{
    {"response_time_ns", &CallbackReport::response_time},
    {"response_time_lower_ns", &CallbackReport::response_time_lower},
    {"response_time_upper_ns", &CallbackReport::response_time_upper},
    {"start_latency_ns", &CallbackReport::start_latency},
    {"duration_ns", &CallbackReport::duration},
    {"inter_arrival_ns", &CallbackReport::inter_arrival},
    {"execution_time_ns", &CallbackReport::execution_time},
    {"preempted_ns", &CallbackReport::preempted},
    {"blocked_ns", &CallbackReport::blocked},
    {"wake_delay_ns", &CallbackReport::wake_delay},
    {"wakeup_latency_ns", &CallbackReport::wakeup_latency},
}};
constexpr std::array<std::string_view, 9> kParts{"count", "min", "max", "sum",  "mean",
                                                 "p50",   "p90", "p99", "p99_9"};

template <typename T>
std::string field(const std::optional<T>& value) {
  return value ? fmt::format("{}", *value) : std::string{};
}

std::string fields(const std::optional<Summary>& s) {
  if (!s) {
    return std::string(kParts.size(), ',');
  }
  return fmt::format(",{},{},{},{},{},{},{},{},{}", s->count, s->min, s->max, s->sum, s->mean,
                     s->p50, s->p90, s->p99, s->p99_9);
}

std::string tids(const CallbackReport& callback) {
  std::string result;
  for (const auto& thread : callback.threads) {
    result += fmt::format("{}{}", result.empty() ? "" : " ", thread.tid);
  }
  return result;
}

}  // namespace

void write_report_csv(std::ostream& out, const analysis::Report& report) {
  out << "logical_id,pid,node,kind,source,symbol,period_ns,group,tids,isolated,instances,"
         "incomplete,missed_releases,release_source";
  for (const auto& quantity : kQuantities) {
    for (const auto part : kParts) {
      out << ',' << quantity.name << '_' << part;
    }
  }
  out << '\n';
  for (const auto& c : report.callbacks) {
    out << csv_field(c.logical_id) << ',' << c.pid << ',' << csv_field(c.node) << ','
        << csv_field(c.kind) << ',' << csv_field(c.source) << ',' << csv_field(c.symbol) << ','
        << field(c.period_ns) << ',' << field(c.group) << ',' << tids(c) << ','
        << (c.isolated ? "true" : "false") << ',' << c.instances << ',' << c.incomplete << ','
        << field(c.missed_releases) << ','
        << (c.release_source ? analysis::label(*c.release_source) : std::string_view{});
    for (const auto& quantity : kQuantities) {
      out << fields(c.*(quantity.summary));
    }
    out << '\n';
  }
}

}  // namespace cie::viewer_export
