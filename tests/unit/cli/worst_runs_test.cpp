// What the thread of a callback's worst run did while it waited.
#include "worst_runs.hpp"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

using analysis::CallbackIndex;
using analysis::Instance;

constexpr CallbackIndex kLogger{0};
constexpr CallbackIndex kMapper{1};
constexpr CallbackIndex kUrgent{2};

Instance run_of(CallbackIndex callback, std::int64_t release, std::int64_t start, std::int64_t end,
                std::int64_t tid = 7) {
  Instance instance;
  instance.state = analysis::InstanceState::complete;
  instance.callback = callback;
  instance.tid = tid;
  instance.release = analysis::Timestamp{release};
  instance.release_source = analysis::ReleaseSource::exact;
  instance.start = {start};
  instance.end = analysis::Timestamp{end};
  return instance;
}

std::optional<viewer_export::WorstRun::Behind> urgent_is_behind(const std::vector<Instance>& runs) {
  WorstRuns worst;
  for (const auto& run : runs)
    worst.on_instance(run);
  for (const auto& run : std::move(worst).take()) {
    if (run.callback == kUrgent) return run.behind;
  }
  return std::nullopt;
}

TEST(WorstRuns, SayHowMuchOfTheLatencyTheOtherCallbackTook) {
  // It waits 100: 52 for the logger, which began before, and 48 for the mapper.
  const auto behind = urgent_is_behind(
      {run_of(kLogger, 0, 2, 62), run_of(kMapper, 0, 62, 110), run_of(kUrgent, 10, 110, 111)});
  ASSERT_TRUE(behind);
  EXPECT_EQ(behind->callback, kLogger);
  EXPECT_EQ(behind->time.ns, 62 - 10);
}

TEST(WorstRuns, OfMoreRunsThanAreRememberedSayWhatItIsAtLeast) {
  std::vector<Instance> runs;
  for (std::int64_t i = 0; i < 100; ++i)
    runs.push_back(run_of(kLogger, 10 * i, 10 * i, 10 * (i + 1)));
  auto early = runs;
  early.push_back(run_of(kUrgent, 0, 1000, 1001));
  const auto behind = urgent_is_behind(early);
  ASSERT_TRUE(behind);
  EXPECT_TRUE(behind->is_at_least);
  EXPECT_LE(behind->time.ns, 1000);
  auto late = runs;
  late.push_back(run_of(kUrgent, 900, 1000, 1001));  // behind the last ten
  const auto exact = urgent_is_behind(late);
  ASSERT_TRUE(exact);
  EXPECT_FALSE(exact->is_at_least);
  EXPECT_EQ(exact->time.ns, 1000 - 900);
}

TEST(WorstRuns, LessThanHalfOfItIsNoReason) {
  EXPECT_FALSE(urgent_is_behind({run_of(kLogger, 0, 2, 50), run_of(kUrgent, 10, 110, 111)}));
}

TEST(WorstRuns, HaveThePartsOfTheRun) {
  auto run = run_of(kUrgent, 10, 110, 210);
  run.execution = analysis::Duration{20};
  run.preempted = analysis::Duration{50};
  run.blocked = analysis::Duration{5};
  run.wake_delay = analysis::Duration{25};
  // In the order in which they ran.
  const std::vector<analysis::Preemptor> others{{.tid = 9, .name = "sow", .time = {20}},
                                                {.tid = 8, .name = "hog", .time = {30}}};
  run.preempted_by = others;
  WorstRuns worst;
  worst.on_instance(run);
  const auto runs = std::move(worst).take();
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_EQ(runs[0].execution, analysis::Duration{20});
  EXPECT_EQ(runs[0].wake_delay, analysis::Duration{25});
  EXPECT_EQ(runs[0].preempted_by, "hog");
  EXPECT_EQ(runs[0].preempted_by_time, analysis::Duration{30}) << "of 50";
}

TEST(WorstRuns, TheIdleThreadPreemptsNobody) {
  auto run = run_of(kUrgent, 10, 110, 210);
  run.preempted = analysis::Duration{50};
  const std::vector<analysis::Preemptor> others{{.tid = 9, .name = "sow", .time = {20}},
                                                {.tid = 0, .name = "swapper/1", .time = {30}}};
  run.preempted_by = others;
  WorstRuns worst;
  worst.on_instance(run);
  const auto runs = std::move(worst).take();
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_EQ(runs[0].idle, analysis::Duration{30});
  EXPECT_EQ(runs[0].preempted_by, "sow");
  EXPECT_EQ(runs[0].preempted_by_time, analysis::Duration{20});
}

TEST(WorstRuns, WithoutThreadsNothingIsKnown) {
  EXPECT_FALSE(
      urgent_is_behind({run_of(kLogger, 0, 2, 100, -1), run_of(kUrgent, 10, 110, 111, -1)}));
}

}  // namespace
}  // namespace cie::cli
