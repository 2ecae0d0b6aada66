// What a hot event costs: through the facade, and as a bare LTTng tracepoint of the same payload;
// disabled, and recorded by cie-record with vpid and vtid.
//
//   cie_bench_tracepoints             prints the table (starts itself under cie-record)
//   cie_bench_tracepoints --measure   prints one line per operation for the state it finds
#include <cie/tracepoints/trace.hpp>

#include "bare.hpp"
#include "live/record/sandbox.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

// Small enough for the buffers; between two batches the consumer daemon catches up.
constexpr std::uint64_t kBatch = 10'000;
constexpr int kBatches = 60;
constexpr std::chrono::milliseconds kPause{3};

struct Operation {
  std::string name;
  std::function<void(std::uint64_t)> facade;
  std::function<void(std::uint64_t)> bare;
};

double nanoseconds_per_event(const std::function<void(std::uint64_t)>& loop) {
  double best = std::numeric_limits<double>::max();
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto begin = Clock::now();
    loop(kBatch);
    const std::chrono::duration<double, std::nano> time = Clock::now() - begin;
    best = std::min(best, time.count() / static_cast<double>(kBatch));
    std::this_thread::sleep_for(kPause);
  }
  return best;
}

std::vector<Operation> operations(cie::trace::Callback& callback,
                                  cie::trace::Publisher& publisher) {
  using cie::CallbackStatus;
  using cie::ReleaseKind;
  using cie::WakeupReason;
  return {
      {"callback_start",
       [&callback](std::uint64_t count) {
         const cie::trace::Callback::Release release{.kind = ReleaseKind::data,
                                                     .release_ns = 10,
                                                     .missed = 0,
                                                     .source_timestamp_realtime_ns = 20,
                                                     .writer_gid = 30};
         for (std::uint64_t i = 0; i < count; ++i) {
           callback.start(release);
         }
       },
       cie::bench::bare_start},
      {"callback_end",
       [&callback](std::uint64_t count) {
         for (std::uint64_t i = 0; i < count; ++i) {
           callback.end(i, CallbackStatus::ok);
         }
       },
       cie::bench::bare_end},
      {"thread_wakeup",
       [&callback](std::uint64_t count) {
         for (std::uint64_t i = 0; i < count; ++i) {
           cie::trace::thread_wakeup(callback.id(), WakeupReason::timer);
         }
       },
       cie::bench::bare_wakeup},
      {"callback_release",
       [&callback](std::uint64_t count) {
         for (std::uint64_t i = 0; i < count; ++i) {
           callback.release(0);
         }
       },
       cie::bench::bare_release},
      {"publish (1 cmpxchg16b)",
       [&publisher](std::uint64_t count) {
         for (std::uint64_t i = 0; i < count; ++i) {
           publisher.publish(static_cast<std::int64_t>(i));
         }
       },
       cie::bench::bare_publish},
  };
}

void measure() {
  const cie::trace::Run run(cie::ExecutorKind::isolated, "");
  const cie::trace::Node node("/bench");
  const cie::trace::Group group(node.id(), cie::GroupType::mutually_exclusive);
  cie::trace::Callback callback({.group = group.id(), .node = node.id(), .logical_id = "/bench"});
  cie::trace::Publisher publisher(node.id(), "/topic", 1);
  const cie::trace::Thread thread(cie::ThreadRole::callback, callback.id(), group.id(), "bench");
  for (const Operation& operation : operations(callback, publisher)) {
    const double facade = nanoseconds_per_event(operation.facade);
    const double bare = nanoseconds_per_event(operation.bare);
    std::printf("%s\t%.2f\t%.2f\n", operation.name.c_str(), facade, bare);
  }
  std::atomic<std::uint64_t> counter{0};
  const double atomic = nanoseconds_per_event([&counter](std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      counter.fetch_add(1, std::memory_order_relaxed);
    }
  });
  std::printf("(an atomic increment alone)\t%.2f\t%.2f\n", atomic, 0.0);
  // A message needs a stamp of its own, traced or not: the rest of publish() is what tracing adds.
  const double stamped = nanoseconds_per_event([&publisher](std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      publisher.publish();
    }
  });
  const double stamp = nanoseconds_per_event([&publisher](std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      publisher.next_source_timestamp();
    }
  });
  std::printf("(publish that stamps too)\t%.2f\t%.2f\n", stamped, 0.0);
  std::printf("(such a stamp alone)\t%.2f\t%.2f\n", stamp, 0.0);
}

struct Costs {
  double facade = 0;
  double bare = 0;
};

std::vector<std::pair<std::string, Costs>> parse(const std::string& text) {
  std::vector<std::pair<std::string, Costs>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t tab = line.find('\t');
    if (tab == std::string::npos) {
      continue;
    }
    std::istringstream numbers(line.substr(tab));
    Costs costs;
    numbers >> costs.facade >> costs.bare;
    rows.emplace_back(line.substr(0, tab), costs);
  }
  return rows;
}

int print_table(const std::string& self) {
  cie::test::Sandbox sandbox(cie::test::User::current);
  if (!sandbox.skip_reason().empty()) {
    std::printf("%s\n", sandbox.skip_reason().c_str());
    return 1;
  }
  const cie::test::Finished disabled = sandbox.run({self, "--measure"});
  const cie::test::Finished enabled =
      sandbox.run({CIE_RECORD, "-o", "bench", "--event", "cie_bare:*", "--subbuf-size", "4m",
                   "--num-subbuf", "8", "--", self, "--measure"});
  if (enabled.status != 0) {
    std::fputs(enabled.err.c_str(), stderr);
    return 1;
  }
  if (enabled.err.find("LOST") != std::string::npos) {
    std::fputs("events were discarded, which is cheaper than recording them: no result\n", stderr);
    return 1;
  }
  const auto off = parse(disabled.out);
  const auto on = parse(enabled.out);
  std::printf("%-28s %9s %9s %9s %9s %7s\n", "ns per event (best batch)", "disabled", "bare",
              "enabled", "bare", "ratio");
  for (std::size_t i = 0; i < std::min(off.size(), on.size()); ++i) {
    std::printf("%-28s %9.2f %9.2f %9.1f %9.1f", off[i].first.c_str(), off[i].second.facade,
                off[i].second.bare, on[i].second.facade, on[i].second.bare);
    if (on[i].second.bare > 0) {
      std::printf(" %7.2f", on[i].second.facade / on[i].second.bare);
    }
    std::printf("\n");
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--measure") {
    measure();
    return 0;
  }
  return print_table(std::filesystem::read_symlink("/proc/self/exe").string());
}
