// cie_bench_export: what it costs to write one recording as a file of each format, beside reading
// it.
#include "child_cost.hpp"
#include "support/temporary_directory.hpp"
#include "synthetic_trace.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <unistd.h>

namespace bench {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kEventsPerInstance = 4;
constexpr std::uint64_t kColumns = 17;  // of the table of instances

struct Format {
  const char* name;
  std::vector<std::string> words;  // of the command
};

const std::vector<Format>& formats() {
  static const std::vector<Format> all{
      {"html", {"report", "-f", "html"}},       {"csv", {"export", "--to", "csv"}},
      {"jsonl", {"export", "--to", "jsonl"}},   {"parquet", {"export", "--to", "parquet"}},
      {"sqlite", {"export", "--to", "sqlite"}}, {"perfetto", {"export", "--to", "perfetto"}}};
  return all;
}

// The columns of all instances as they would lie in memory, 64 bits each, written to `file`.
Cost copy_columns(const fs::path& file, std::uint64_t instances) {
  return measure([&file, instances] {
    constexpr std::size_t kBlock = 1U << 17U;
    std::vector<std::uint64_t> column(kBlock);
    const int out = ::open(file.c_str(), O_CREAT | O_TRUNC | O_WRONLY | O_CLOEXEC, 0600);
    if (out < 0) ::_exit(1);
    for (auto left = kColumns * instances; left > 0;) {
      const auto count = std::min<std::uint64_t>(left, kBlock);
      for (std::uint64_t i = 0; i < count; ++i)
        column[i] = left - i;
      const auto bytes = count * sizeof(std::uint64_t);
      if (::write(out, column.data(), bytes) != static_cast<::ssize_t>(bytes)) ::_exit(1);
      left -= count;
    }
    ::_exit(0);
  });
}

class Table {
 public:
  Table(const Cost& reading, const Cost& copying) : reading_(reading), copying_(copying) {
    std::printf("%-22s %9s %8s %7s %7s %8s %8s %8s %8s\n", "", "MB", "MiB", "CPU s", "wall s",
                "own CPU", "x plain", "own wall", "x plain");
  }

  // `own` is what a command costs beside reading the recording.
  void row(const std::string& what, std::uintmax_t bytes, const Cost& cost, const Cost& own) const {
    std::printf("%-22s %9.1f %8.1f %7.2f %7.2f %8.2f %8.1f %8.2f %8.1f\n", what.c_str(),
                static_cast<double>(bytes) / 1e6, cost.peak_mib, cost.cpu_s, cost.wall_s, own.cpu_s,
                own.cpu_s / copying_.cpu_s, own.wall_s, own.wall_s / copying_.wall_s);
    std::fflush(stdout);
  }
  Cost own(const Cost& cost) const {
    return {.cpu_s = std::max(0.0, cost.cpu_s - reading_.cpu_s),
            .wall_s = std::max(0.0, cost.wall_s - reading_.wall_s),
            .peak_mib = cost.peak_mib};
  }

 private:
  Cost reading_;
  Cost copying_;
};

void run_format(const Format& format, const std::string& cie,
                const cie::test::TemporaryDirectory& scratch, double most_mib, const Table& table) {
  const auto out = (scratch.path() / "out").string();
  std::vector<std::string> words{cie};
  words.insert(words.end(), format.words.begin(), format.words.end());
  words.insert(words.end(), {(scratch.path() / "trace").string(), "-o", out});
  ::sync();
  const auto cost = measure_program(words);
  const auto bytes = fs::file_size(out);
  if (bytes == 0) throw std::runtime_error(std::string(format.name) + ": nothing was written");
  if (cost.peak_mib > most_mib)
    throw std::runtime_error(std::string(format.name) + ": takes more memory than --most-memory");
  table.row(format.name, bytes, cost, table.own(cost));
  ::sync();
  const auto copied = measure_program({"cp", out, out + ".copy"});
  table.row(std::string("  cp of that file"), bytes, copied, copied);
  fs::remove(out);
  fs::remove(out + ".copy");
}

int run(int argc, char** argv) {
  std::uint64_t instances = 10'000'000;
  std::uint32_t streams = 64;
  double most_mib = 1e9;
  std::string directory = fs::temp_directory_path().string();
  CLI::App app("Cost of writing one recording as a file of each format");
  app.add_option("--instances", instances, "About how many runs of callbacks (10000000)");
  app.add_option("--streams", streams, "Streams, one per CPU, with two callbacks each (64)")
      ->check(CLI::Range(1, 4096));
  app.add_option("--directory", directory, "Where recording and files go (TMPDIR or /tmp)");
  app.add_option("--most-memory", most_mib, "Fail if a command takes more MiB");
  CLI11_PARSE(app, argc, argv);

  const cie::test::TemporaryDirectory scratch(directory);
  const auto trace = scratch.path() / "trace";
  write_trace(trace, {.events = kEventsPerInstance * instances, .streams = streams});
  const auto cie = (fs::read_symlink("/proc/self/exe").parent_path() / "cie").string();
  const auto plain = scratch.path() / "columns";
  ::sync();
  const auto copying = copy_columns(plain, instances);
  const auto plain_bytes = fs::file_size(plain);
  fs::remove(plain);
  // The first reading is the slower one.
  measure_program({cie, "report", "-f", "json", trace.string()});
  const auto reading = measure_program({cie, "report", "-f", "json", trace.string()});
  std::printf(
      "about %ju instances; \"own\" is without reading the recording, \"x plain\" against a "
      "plain copy of the columns\n\n",
      static_cast<std::uintmax_t>(instances));
  const Table table(reading, copying);
  table.row("plain copy of columns", plain_bytes, copying, copying);
  table.row("cie report (reading)", 0, reading, {});
  for (const auto& format : formats())
    run_format(format, cie, scratch, most_mib, table);
  return 0;
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  try {
    return bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie_bench_export: %s\n", error.what());
    return 1;
  }
}
