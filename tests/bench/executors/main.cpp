// cie-bench-executors and cie-bench-rclcpp: what one message costs under each executor.
#include "measurement.hpp"
#include "table.hpp"
#include "workload.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace bench {
namespace {

struct Settings {
  std::vector<std::string> executors = executor_names();
  std::vector<std::string> policies{"fifo", "other"};
  std::vector<std::string> placements{"intra", "inter"};
  std::vector<std::string> phases{"staggered", "aligned"};
  std::vector<unsigned> pairs{1, 4, 8, 12, 16, 20, 24};
  std::vector<unsigned> payloads{32};
  std::vector<std::string> passings{"copy"};
  Workload common;
  double seconds = 2;
  int period_ms = 10;
  int fifo_priority = 50;
  std::string csv;
};

// The table's rows: every combination, the last setting changing fastest.
std::vector<Workload> workloads(const Settings& settings) {
  std::vector<Workload> rows{settings.common};
  rows.front().period = std::chrono::milliseconds{settings.period_ms};
  const auto multiply = [&rows](const auto& values, auto set) {
    std::vector<Workload> product;
    for (const Workload& row : rows) {
      for (const auto& value : values) {
        product.push_back(row);
        set(product.back(), value);
      }
    }
    rows = std::move(product);
  };
  multiply(settings.policies, [&settings](Workload& row, const std::string& value) {
    row.fifo_priority = value == "fifo" ? settings.fifo_priority : 0;
  });
  multiply(settings.placements, [](Workload& row, const std::string& value) {
    row.placement = value == "intra" ? Placement::intra : Placement::inter;
  });
  multiply(settings.phases, [](Workload& row, const std::string& value) {
    row.phases = value == "aligned" ? Phases::aligned : Phases::staggered;
  });
  multiply(settings.executors,
           [](Workload& row, const std::string& value) { row.executor = value; });
  multiply(settings.payloads, [](Workload& row, unsigned value) { row.payload = value; });
  multiply(settings.passings, [](Workload& row, const std::string& value) {
    row.passing = value == "copy"      ? Passing::copy
                  : value == "pointer" ? Passing::pointer
                  : value == "shared"  ? Passing::shared
                                       : Passing::serialized;
  });
  multiply(settings.pairs, [](Workload& row, unsigned value) { row.pairs = value; });
  return rows;
}

int run(const Settings& settings) {
  make_tracefs_visible();
  std::optional<CsvFile> csv;
  if (!settings.csv.empty()) csv.emplace(settings.csv);
  std::printf("period %d ms, %s, fifo: SCHED_FIFO %d, %.1f s per row\n\n", settings.period_ms,
              settings.common.best_effort ? "best effort" : "reliable", settings.fifo_priority,
              settings.seconds);
  print_head();
  std::vector<Row> rows;
  bool is_good = true;
  for (const Workload& workload : workloads(settings)) {
    const auto measured = measure(workload, settings.seconds);
    is_good = is_good && measured.has_value();
    if (!measured) continue;
    rows.push_back({workload, *measured});
    print(rows.back());
    if (csv) csv->write(rows.back());
  }
  print_ratios(rows);
  return is_good ? 0 : 1;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  CLI::App app{
      R"(The paper's experiment: N timers publish, N subscriptions receive. Per message: system calls
and context switches of all threads of all processes (those of DDS too), CPU time, and the
)"
      "time from publish to callback. System calls need root and tracefs."};
  app.name(std::filesystem::path{argv[0]}.filename());
  app.add_option("--executors", settings.executors)
      ->check(CLI::IsMember(bench::executor_names()))
      ->delimiter(',');
  app.add_option("--paths", settings.placements, "intra: one process, inter: two")
      ->check(CLI::IsMember({"intra", "inter"}))
      ->delimiter(',');
  app.add_option("--phases", settings.phases, "Of the timers")
      ->check(CLI::IsMember({"aligned", "staggered"}))
      ->delimiter(',');
  app.add_option("-n,--pairs", settings.pairs, "Timers, and subscriptions")
      ->check(CLI::Range(1U, 64U))
      ->delimiter(',');
  app.add_option("--seconds", settings.seconds, "Per row")->check(CLI::Range(0.1, 3600.0));
  app.add_option("--period", settings.period_ms, "Milliseconds")->check(CLI::Range(1, 10000));
  app.add_option("--payload", settings.payloads, "Bytes")
      ->check(CLI::Range(0U, 10000000U))
      ->delimiter(',');
  app.add_option(
         "--passing", settings.passings,
         "copy: publish a reference; pointer: hand the message over; serialized: by Cyclone "
         "DDS alone; shared: through shared memory, with iox-roudi running")
      ->check(CLI::IsMember({"copy", "pointer", "serialized", "shared"}))
      ->delimiter(',');
  app.add_option("--threads", settings.common.threads, "Of multi; 0: one for each CPU");
  app.add_option("--policies", settings.policies, "Of all threads; other: SCHED_OTHER")
      ->check(CLI::IsMember({"fifo", "other"}))
      ->delimiter(',');
  app.add_option("--priority", settings.fifo_priority, "Of fifo")->check(CLI::Range(1, 99));
  app.add_option("--csv", settings.csv, "Also write all numbers into this file");
  app.add_flag("--best-effort", settings.common.best_effort);
  CLI11_PARSE(app, argc, argv);
  try {
    return bench::run(settings);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 2;
  }
}
