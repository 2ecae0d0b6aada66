// What of a recording is compared with another one.
#include <cie/analysis/comparison.hpp>

#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

Instance instance_at(std::int64_t start, ReleaseSource source, std::int64_t waited) {
  Instance instance;
  instance.logical_id = "/a";
  instance.release = Timestamp{start - waited};
  instance.release_source = source;
  instance.start = Timestamp{start};
  instance.end = Timestamp{start + 100};
  return instance;
}

// Releases known, wake-ups, messages' source times, and nothing: of a tenth of all runs each.
TEST(SampleCollector, BoundsWhatHasNoRelease) {
  SampleCollector collector;
  for (std::int64_t i = 0; i < 10; ++i) {
    collector.on_instance(instance_at(1'000 * i, ReleaseSource::exact, 20));
    collector.on_instance(instance_at(1'000 * i, ReleaseSource::wakeup, 10));
    collector.on_instance(instance_at(1'000 * i, ReleaseSource::source_timestamp, 50));
    collector.on_instance(instance_at(1'000 * i, ReleaseSource::start, 0));
  }
  Report report;
  report.callbacks.emplace_back().logical_id = "/a";
  report.callbacks.back().kind = CallbackKind::subscription;
  const auto sample = collector.samples(report).at(0);
  EXPECT_EQ(sample.response_time.count, 40U);
  // At least: 100 twenty times, 110, 120. At most: 120 ten times, 150 ten times.
  EXPECT_EQ(sample.response_time.at_least.at(20), 100);
  EXPECT_EQ(sample.response_time.at_least.rbegin()->second, 120);
  EXPECT_EQ(sample.response_time.at_most.at(20), 150);
  EXPECT_EQ(sample.response_time.at_most.rbegin()->first, 20U);
  EXPECT_EQ(sample.start_latency.at_least.at(20), 0);
  EXPECT_EQ(sample.start_latency.at_most.at(20), 50);
}

// A process, and when its callback was made, ran once for 100 ns, and ended.
struct OneRun {
  TimeWindow process;
  TimeWindow callback;
  std::optional<std::int64_t> start;
};

CallbackSample sample_of(const std::vector<OneRun>& processes) {
  SampleCollector collector;
  Report report;
  for (std::uint32_t i = 0; i < processes.size(); ++i) {
    auto& process = report.processes.emplace_back();
    process.index = ProcessIndex{i};
    process.lived = processes[i].process;
    auto& callback = report.callbacks.emplace_back();
    callback.index = CallbackIndex{i};
    callback.process = ProcessIndex{i};
    callback.logical_id = "/a";
    callback.lived = processes[i].callback;
    if (!processes[i].start) continue;
    auto instance = instance_at(*processes[i].start, ReleaseSource::exact, 20);
    instance.callback = callback.index;
    instance.process = callback.process;
    collector.on_instance(instance);
  }
  return collector.samples(report).at(0);
}

TEST(SampleCollector, CountsProcessesThatHadACallbackAtOneTime) {
  const auto at_once = [](const std::vector<OneRun>& processes) {
    return sample_of(processes).processes_at_once;
  };
  const auto window = [](std::int64_t from, std::int64_t to) {
    return TimeWindow{.from = Timestamp{from}, .to = Timestamp{to}};
  };
  const auto since = [](std::int64_t from) { return TimeWindow{.from = Timestamp{from}}; };
  const auto until = [](std::int64_t to) { return TimeWindow{.to = Timestamp{to}}; };
  const auto all = window(0, 9'000);
  EXPECT_EQ(at_once({{all, all, 1'000}, {all, all, 1'000}}), 2U);
  EXPECT_EQ(at_once({{all, all, 1'000}, {all, all, 2'000}}), 2U) << "whenever it runs";
  EXPECT_EQ(at_once({{all, all, 1'000}, {all, all, std::nullopt}}), 2U) << "or never";
  EXPECT_EQ(
      at_once({{window(0, 1'500), since(1), 1'000}, {window(1'600, 9'000), since(1'601), 2'000}}),
      1U)
      << "restarted";
  EXPECT_EQ(at_once({{all, window(1, 1'500), 1'000}, {all, window(1'600, 8'000), 2'000}}), 1U)
      << "unloaded from one, then loaded into the other";
  EXPECT_EQ(at_once({{until(9'000), until(8'000), 1'000}, {until(9'000), until(8'000), 2'000}}), 2U)
      << "attached to: they ended together";
  EXPECT_EQ(at_once({{since(0), since(1), 1'000}, {since(0), since(2), 1'050}}), 2U)
      << "their ends were not seen, and their runs overlap";
  EXPECT_EQ(at_once({{since(0), since(1), 1'000}, {since(1'500), since(1'600), 2'000}}),
            std::nullopt)
      << "the first may have been killed";
}

TEST(SampleCollector, KnowsWhatNeverEndsByTotals) {
  Report report;
  auto& callback = report.callbacks.emplace_back();
  callback.logical_id = "/a";
  const auto never_ends = [&report] { return SampleCollector().samples(report).at(0).never_ends; };
  EXPECT_EQ(never_ends(), false);
  callback.incomplete = 1;
  callback.longest_open = OpenRun{.until_end = Duration{100}};
  EXPECT_EQ(never_ends(), false) << "cut by the end of the recording";
  callback.longest_open->response_least = Duration{100};
  EXPECT_EQ(never_ends(), true) << "as totals prove";
  report.callbacks.push_back(callback);
  report.callbacks[0].longest_open->response_least.reset();
  EXPECT_EQ(never_ends(), true) << "of one of two processes";
}

TEST(SampleCollector, KnowsWhoClaimsIsolation) {
  Report report;
  report.processes.emplace_back();
  auto& thread = report.threads.emplace_back();
  auto& callback = report.callbacks.emplace_back();
  callback.logical_id = "/a";
  callback.threads = {CallbackThread{.thread = {}, .tid = 7, .name = "a", .instances = 1}};
  const auto is_claimed = [&report] {
    return SampleCollector().samples(report).at(0).is_isolation_claimed;
  };
  report.processes.front().executor = "multi_threaded";
  thread.role = ThreadRole::pool;
  EXPECT_FALSE(is_claimed());
  thread.role = ThreadRole::callback;
  EXPECT_TRUE(is_claimed());
  thread.role.reset();
  EXPECT_FALSE(is_claimed());
  report.processes.front().executor = "isolated";
  EXPECT_TRUE(is_claimed());
  report.processes.front().executor.reset();  // ROS 2 names none
  EXPECT_TRUE(is_claimed()) << "no callback of the process shared its thread";
  auto other = callback;
  other.logical_id = "/b";
  other.isolation = Isolation::not_isolated;
  report.callbacks.push_back(other);
  EXPECT_FALSE(is_claimed());
}

}  // namespace
}  // namespace cie::analysis
