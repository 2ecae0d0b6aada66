// cie_bench_readers: processor and elapsed time of reading one trace, by reader.
#include "child_cost.hpp"
#include "support/temporary_directory.hpp"
#include "synthetic_trace.hpp"

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <ctf/native_reader.hpp>
#include <unistd.h>

namespace bench {
namespace {

namespace fs = std::filesystem;

void print(const char* what, const Cost& cost, std::uint64_t events, const Cost& reference) {
  std::printf("%-34s %8.1f %8.2f %9.1f", what, cost.peak_mib, cost.cpu_s,
              cost.cpu_s * 1e9 / static_cast<double>(events));
  if (reference.cpu_s > 0) std::printf(" %7.1f", reference.cpu_s / cost.cpu_s);
  std::printf(" %8.2f", cost.wall_s);
  if (reference.wall_s > 0) std::printf(" %7.1f", reference.wall_s / cost.wall_s);
  std::printf("\n");
}

std::uint64_t count_events(const std::string& directory) {
  std::uint64_t seen = 0;
  const std::vector<fs::path> paths{directory};
  cie::analysis::ctf::TraceReader(paths, {}).read([&seen](const cie::analysis::EventBatch& batch) {
    batch.each([&seen](const cie::analysis::Event& event) {
      seen += category_of(event.body) != cie::analysis::EventCategory::structure;
    });
  });
  return seen;
}

// By a child, because what is resident here would count as its children's.
std::uint64_t count_apart(const std::string& directory) {
  const cie::test::TemporaryDirectory scratch;
  const auto file = scratch.path() / "events";
  measure([&] {
    std::ofstream(file) << count_events(directory);
    ::_exit(0);
  });
  std::uint64_t events = 0;
  std::ifstream(file) >> events;
  return events;
}

struct Options {
  bool without_babeltrace2 = false;
  double most_mib = std::numeric_limits<double>::infinity();
};

void compare(const std::string& directory, std::uint64_t events, const Options& options) {
  const bool without_babeltrace2 = options.without_babeltrace2;
  const auto cie = (fs::read_symlink("/proc/self/exe").parent_path() / "cie").string();
  std::printf("%-34s %8s %8s %9s %7s %8s %7s\n", "", "MiB", "CPU s", "ns/event",
              without_babeltrace2 ? "" : "times", "wall s", without_babeltrace2 ? "" : "times");
  std::fflush(stdout);
  Cost reference;
  if (!without_babeltrace2) {
    reference = measure_program({"babeltrace2", "-c", "sink.utils.dummy", directory});
    print("babeltrace2 -c sink.utils.dummy", reference, events, reference);
  }
  const auto decode =
      measure([&directory, events] { ::_exit(count_events(directory) == events ? 0 : 1); });
  print("cie: decode and merge", decode, events, reference);
  print("cie instances", measure_program({cie, "instances", directory}), events, reference);
  const auto report = measure_program({cie, "report", "--format", "json", directory});
  print("cie report", report, events, reference);
  if (report.peak_mib > options.most_mib)
    throw std::runtime_error("cie report takes more memory than --most-memory");
}

void compare(const TraceSize& size, const std::string& keep, const Options& options) {
  std::optional<cie::test::TemporaryDirectory> scratch;
  const std::string directory = keep.empty() ? scratch.emplace().path().string() : keep;
  const auto events = write_trace(directory, size);
  std::printf("%ju events, %u callbacks, %u streams, packets of %u bytes\n\n",
              static_cast<std::uintmax_t>(events), 2 * size.streams * size.applications,
              size.streams, size.packet_bytes);
  compare(directory, events, options);
}

int run(int argc, char** argv) {
  TraceSize size;
  std::vector<std::string> recordings;
  std::string directory;
  Options options;
  CLI::App app("Processor and elapsed time of reading one trace, by reader");
  app.add_option("recordings", recordings, "Read these in place of synthetic ones");
  app.add_option("--events", size.events, "About how many events (20000000)");
  app.add_option("--streams", size.streams, "Streams, one per CPU (64)")
      ->check(CLI::Range(1, 4096));
  app.add_option("--applications", size.applications, "On each CPU, of two callbacks each (1)")
      ->check(CLI::Range(1, 4096));
  app.add_option("--packet", size.packet_bytes, "Bytes of a packet (524288)");
  app.add_option("--keep", directory, "Write the trace there and leave it");
  app.add_flag("--only-cie", options.without_babeltrace2, "Do not run babeltrace2");
  app.add_option("--most-memory", options.most_mib, "Fail if a report takes more MiB");
  CLI11_PARSE(app, argc, argv);

  for (const auto& recording : recordings) {
    const auto events = count_apart(recording);
    std::printf("%s: %ju events\n\n", recording.c_str(), static_cast<std::uintmax_t>(events));
    compare(recording, events, options);
  }
  if (!recordings.empty()) return 0;
  compare(size, directory, options);
  if (argc > 1) return 0;
  std::printf("\n");
  compare(TraceSize{.events = 1'000'000, .streams = 4, .applications = 1250}, {}, {});
  return 0;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  try {
    return bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie_bench_readers: %s\n", error.what());
    return 1;
  }
}
