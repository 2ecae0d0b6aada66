#include <cie/tracepoints/sha256.hpp>
#include <cie/viewer_export/fleet_export.hpp>

#include <charconv>
#include <chrono>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

constexpr std::int64_t kDayNs = 86'400'000'000'000;
// What a date of two bytes, as ClickHouse has it, can hold.
constexpr std::int64_t kLastDay = 65'535;

std::string date_of(std::chrono::year_month_day date) {
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

int number_at(std::string_view text, std::size_t begin, std::size_t size) {
  int number = -1;
  const auto part = text.substr(begin, size);
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
  return error == std::errc{} && end == part.data() + part.size() ? number : -1;
}

// Of "2026-11-20"; empty unless it is exactly that, from 1970 on.
std::optional<std::int32_t> parsed_day(std::string_view text) {
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return std::nullopt;
  const int year = number_at(text, 0, 4);
  const int month = number_at(text, 5, 2);
  const int day = number_at(text, 8, 2);
  if (year < 1970 || month < 1 || day < 1) return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok()) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return days <= kLastDay ? std::optional(static_cast<std::int32_t>(days)) : std::nullopt;
}

std::optional<std::int32_t> day_of(const analysis::TraceSummary& trace) {
  if (!trace.begin_realtime_ns || *trace.begin_realtime_ns < 0) return std::nullopt;
  const auto day = *trace.begin_realtime_ns / kDayNs;
  return day <= kLastDay ? std::optional(static_cast<std::int32_t>(day)) : std::nullopt;
}

std::string id_of(const analysis::Report& report) {
  const auto number = [](const auto& value) {
    return value ? fmt::format("{}", value->ns) : std::string();
  };
  // Lengths before texts: two lists of names never look alike.
  std::string facts =
      fmt::format("cie recording 1\n{} {} {}\n", number(report.trace.begin),
                  number(report.trace.end), report.trace.begin_realtime_ns.value_or(0));
  for (const auto& host : report.trace.hosts)
    facts += fmt::format("host {} {}\n", host.size(), host);
  for (const auto& p : report.processes) {
    facts += fmt::format("process {} {} {} {} {} {}\n", p.host.size(), p.host, p.boot_id.size(),
                         p.boot_id, p.pid_ns, p.pid);
  }
  return sha256_hex(facts).substr(0, 32);
}

}  // namespace

Label label_of(std::string_view text) {
  const auto at = text.find('=');
  if (at == std::string_view::npos || at == 0) {
    throw std::invalid_argument(
        fmt::format("\"{}\" is no label: NAME=VALUE, for instance software=1.2", text));
  }
  Label label{.name = std::string(text.substr(0, at)), .value = std::string(text.substr(at + 1))};
  if (label.name == "day" && !parsed_day(label.value)) {
    throw std::invalid_argument(
        fmt::format("\"{}\" is no day: YYYY-MM-DD, from 1970 to 2149", label.value));
  }
  return label;
}

RecordingIdentity identify(const analysis::Report& report, std::vector<Label> labels) {
  RecordingIdentity recording{
      .id = id_of(report), .day = day_of(report.trace), .software = {}, .labels = {}};
  for (const Label& label : labels) {
    if (label.name == "software") recording.software = label.value;
    if (label.name == "day") recording.day = parsed_day(label.value);
  }
  recording.labels = std::move(labels);
  return recording;
}

std::string day_text(const RecordingIdentity& recording) {
  return date_of(std::chrono::sys_days(std::chrono::days(recording.day.value_or(0))));
}

}  // namespace cie::viewer_export
