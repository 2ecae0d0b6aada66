#include "export_formats.hpp"

#include "command_line.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr std::array<ExportFormat, 11> kFormats{{
    {.name = "perfetto",
     .kind = ExportKind::viewer,
     .suffix = ".pftrace",
     .purpose = "for ui.perfetto.dev",
     .advice = "Open it at https://ui.perfetto.dev",
     .is_binary = true,
     .is_for_gzip = true,
     .has_messages = true},
    {.name = "chrome",
     .kind = ExportKind::viewer,
     .suffix = ".json",
     .purpose = "where JSON is wanted",
     .advice = "Open it at https://ui.perfetto.dev",
     .is_for_gzip = true,
     .has_messages = true},
    {.name = "speedscope",
     .kind = ExportKind::viewer,
     .suffix = ".speedscope.json",
     .purpose = "flame graphs",
     .advice = "Open it at https://www.speedscope.app",
     .is_for_gzip = true},
    {.name = "otlp",
     .kind = ExportKind::viewer,
     .suffix = ".jsonl",
     .purpose = "OpenTelemetry spans",
     .advice = "Feed it to an OpenTelemetry collector (otlpjsonfile receiver)",
     .is_for_gzip = true,
     .has_messages = true},
    {.name = "mcap",
     .kind = ExportKind::viewer,
     .suffix = ".mcap",
     .purpose = "Foxglove, PlotJuggler",
     .advice = "Open it in Foxglove, Lichtblick or PlotJuggler",
     .is_binary = true,
     .has_messages = true},
    {.name = "dot", .kind = ExportKind::graph, .suffix = ".dot", .purpose = "the callback graph"},
    {.name = "svg", .kind = ExportKind::graph, .suffix = ".svg", .purpose = "the same, drawn"},
    {.name = "sqlite",
     .kind = ExportKind::database,
     .suffix = ".db",
     .purpose = "all tables, for SQL",
     .is_binary = true},
    {.name = "csv", .kind = ExportKind::table, .suffix = ".csv", .purpose = "one table"},
    {.name = "jsonl",
     .kind = ExportKind::table,
     .suffix = ".jsonl",
     .purpose = "one, as JSON lines"},
    {.name = "parquet",
     .kind = ExportKind::table,
     .suffix = ".parquet",
     .purpose = "one, for data frames",
     .is_binary = true},
}};

}  // namespace

std::span<const ExportFormat> export_formats() { return kFormats; }

std::vector<std::string> export_format_names() {
  std::vector<std::string> names;
  names.reserve(kFormats.size());
  for (const auto& format : kFormats)
    names.emplace_back(format.name);
  return names;
}

const ExportFormat& export_format(const std::string& name) {
  check_choice("--to", name, export_format_names());
  return *std::ranges::find(kFormats, std::string_view(name), &ExportFormat::name);
}

std::string export_examples() {
  constexpr std::size_t kCommand = 59;
  std::string text;
  for (const auto& format : kFormats) {
    const auto command =
        fmt::format("  cie export run1 --to {} -o run1{}", format.name, format.suffix);
    text += fmt::format("{:<{}}{}\n", command, kCommand, format.purpose);
  }
  return text;
}

}  // namespace cie::cli
