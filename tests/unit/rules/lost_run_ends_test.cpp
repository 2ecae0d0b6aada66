// Runs whose end is not in the record are told apart: which ended, and which nothing shows to have ended.
#include "windows.hpp"

#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kThreeRuns = R"(
  callback a
  10 start a
  12 end a
  20 start a
  25 end a
  30 start a
  33 end a)";

TextTrace without_end(const char* text, std::uint64_t seq) {
  auto trace = trace_of(text);
  trace.erase<CallbackEnd>(
      [seq](const CallbackEnd& end, const EventHead&) { return end.seq == seq; });
  return trace;
}

std::uint64_t ends_lost(const Verified& verified) {
  std::uint64_t count = 0;
  for (const auto& defect : verified.result.report.defects)
    count += defect.kind == DefectKind::seq_gaps ? defect.count : 0;
  return count;
}

TEST(LostRunEnds, AreNotThoseOfAWholeRecord) { EXPECT_EQ(ends_lost(Verified(kThreeRuns)), 0U); }

TEST(LostRunEnds, AreADefectAndNoRunThatGoesOn) {
  const Verified verified(without_end(kThreeRuns, 1));
  const auto& report = verified.result.report.callbacks.at(0);
  EXPECT_EQ(report.instances, 2U);
  EXPECT_EQ(ends_lost(verified), 1U);
  EXPECT_FALSE(report.longest_open) << "totals count three ends, and it began anew on its thread";
}

TEST(LostRunEnds, TheLastOneIsCountedByTheTotals) {
  EXPECT_FALSE(Verified(without_end(kThreeRuns, 2)).result.report.callbacks.at(0).longest_open);
}

TEST(LostRunEnds, WithoutTotalsALaterRunOnTheThreadShowsThatItEnded) {
  const auto crashed = "process app crash\n" + std::string(kThreeRuns);
  const Verified middle(without_end(crashed.c_str(), 1));
  EXPECT_EQ(ends_lost(middle), 1U);
  EXPECT_FALSE(middle.result.report.callbacks.at(0).longest_open);
  const Verified last(without_end(crashed.c_str(), 2));
  EXPECT_EQ(ends_lost(last), 0U) << "it may have run when the process crashed";
  const auto& open = last.result.report.callbacks.at(0).longest_open;
  ASSERT_TRUE(open);
  EXPECT_EQ(open->seq, 2U);
}

constexpr auto kCrashed =
    "no run_end: interrupted by the end of the recording, while it was still "
    "running, or by a crash; this is its last event";

TEST(LostRunEnds, OfAProcessThatExecutedAnotherProgramIsNoCrash) {
  const auto run = "process app crash\n" + std::string(kThreeRuns);
  const auto told = [](const std::string& trace) {
    const Verified verified(trace);
    EXPECT_EQ(verified.of("T4", "process 100"), Verdict::inconclusive);
    return verified.evidence("T4", "process 100");
  };
  EXPECT_THAT(told(run), HasSubstr(kCrashed));
  const auto executed = told(run + "\n40 exec a");
  EXPECT_THAT(executed, HasSubstr("40 sched_process_exec no run_end: the process executed another "
                                  "program here, in place of its own\n"));
  EXPECT_THAT(executed, Not(HasSubstr("crash")));
  EXPECT_THAT(told(run + "\n31 exec a"), HasSubstr(kCrashed)) << "it emitted events since";
  EXPECT_THAT(told(run + "\n36 exit a\n40 exec a"), HasSubstr(kCrashed)) << "another process";
  EXPECT_EQ(
      Verified(trace_of(run + "\n40 exec a"), {}, {.allow_crash = true}).of("T4", "process 100"),
      Verified(trace_of(run), {}, {.allow_crash = true}).of("T4", "process 100"));
}

}  // namespace
}  // namespace cie::test
