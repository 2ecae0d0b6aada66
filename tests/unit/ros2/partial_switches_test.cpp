// S1 to S4 of recordings that read no parameters back, where the kernel's record is not whole.
#include "ros2_text.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::TimeWindow;
using analysis::Verdict;
using testing::HasSubstr;

// SCHED_FIFO 20 is the kernel's priority 79.
constexpr const char* kFifo20 =
    "callback_groups:\n"
    "  - id: /n@Timer(1)\n"
    "    affinity: [0, 1]\n"
    "    policy: SCHED_FIFO\n"
    "    priority: 20\n";

Ros2Result judged_partly(const std::string& events, const std::string& spec = kFifo20) {
  return analyze_ros2(kTwoTimers + events, -1, spec);
}

// Of a window behind the first instance nobody can tell how that began.
TEST(BeforeTheFirstInstance, IsNotAskedForWhereThatLiesBeforeTheWindow) {
  const TimeWindow later{.from = {15}, .to = {40}};
  const TimeWindow whole{.from = {5}, .to = {40}};
  const auto good = kTwoTimers + instance(10, 79) + instance(20, 120) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20).verdict("S2"), Verdict::pass);
  EXPECT_EQ(analyze_ros2(good, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  const auto bad = kTwoTimers + instance(10, 120) + instance(20, 79) + instance(30, 79);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20).verdict("S2"), Verdict::fail);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, later).verdict("S2"), Verdict::not_applicable);
  EXPECT_EQ(analyze_ros2(bad, -1, kFifo20, whole).verdict("S2"), Verdict::fail);
}

// It was configured before, perhaps, and had changed when its next switch was seen.
TEST(BeforeTheFirstInstance, IsUnknownWithoutASwitchThere) {
  const auto later = instance(20, 120) + instance(30, 79);
  for (const auto* record : {"\n8 kernel_lost 15", "\n8 kernel_begins"}) {
    const bool is_late = std::string(record).ends_with("begins");
    const auto result = judged_partly(is_late ? unswitched_instance(5) + record + later
                                              : record + unswitched_instance(10) + later);
    EXPECT_EQ(result.verdict("S2"), Verdict::inconclusive) << record;
    EXPECT_THAT(result.evidence("S2"), HasSubstr("its priority before is unknown")) << record;
  }
}

TEST(BeforeTheFirstInstance, IsKnownWhateverIsLostLater) {
  const auto unconfigured = instance(10, 120) + "\n15 kernel_lost 16" + instance(20, 79);
  EXPECT_EQ(judged_partly(unconfigured).verdict("S2"), Verdict::fail);
  const auto configured = instance(10, 79) + "\n15 kernel_lost 16" + instance(20, 79);
  EXPECT_EQ(judged_partly(configured).verdict("S2"), Verdict::pass);
}

TEST(BeforeTheFirstInstance, MayHaveHadThePriorityThatWasSeenNowhere) {
  EXPECT_EQ(judged_partly(instance(10, 120) + instance(20, 120)).verdict("S2"),
            Verdict::not_applicable);
  EXPECT_EQ(
      judged_partly(instance(10, 120) + "\n15 kernel_lost 16" + instance(20, 120)).verdict("S2"),
      Verdict::inconclusive);
}

// Real-time priority 90 (9), where 20 is asked for.
TEST(BeforeTheFirstInstance, MayHaveHadAHigherPriorityByInheritance) {
  const auto lost = [](const std::string& hole) {
    return judged_partly(instance(10, 9) + hole + instance(20, 79)).verdict("S2");
  };
  EXPECT_EQ(lost(""), Verdict::fail);
  EXPECT_EQ(lost("\n12 kernel_lost 19"), Verdict::inconclusive);
}

TEST(PartOfTheRun, PassesNothingThatTheRestMayViolate) {
  const auto whole = instance(10, 79) + instance(20, 79) + instance(30, 79);
  const auto early = instance(10, 79) + instance(20, 79) + "\n25 kernel_ends";
  const auto late = "\n15 kernel_begins" + instance(20, 79) + instance(30, 79);
  for (const auto* rule : {"S1", "S3", "S4"}) {
    EXPECT_EQ(judged_partly(whole).verdict(rule), Verdict::pass) << rule;
    const auto ended = judged_partly(early + unswitched_instance(30));
    EXPECT_EQ(ended.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(ended.evidence(rule), HasSubstr("the kernel's record ends here")) << rule;
    const auto begun = judged_partly(unswitched_instance(10) + late);
    EXPECT_EQ(begun.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(begun.evidence(rule), HasSubstr("the kernel's record begins here")) << rule;
    EXPECT_EQ(judged_partly(early).verdict(rule), Verdict::pass) << rule << ": it ran no more";
    EXPECT_EQ(judged_partly(late).verdict(rule), Verdict::pass) << rule << ": it had not run";
  }
}

TEST(PartOfTheRun, FailsWhatItShowsButForTheLastConfiguration) {
  const auto early = instance(10, 79) + instance(20, 120, 3) + "\n25 kernel_ends";
  EXPECT_EQ(judged_partly(early).verdict("S1"), Verdict::fail);
  const auto result = judged_partly(early + unswitched_instance(30));
  for (const auto* rule : {"S3", "S4"})
    EXPECT_EQ(result.verdict(rule), Verdict::fail) << rule;
  EXPECT_EQ(result.verdict("S1"), Verdict::inconclusive) << "it may have been configured anew";
  const auto lost = instance(10, 79) + instance(20, 120) + "\n25 kernel_lost 35";
  EXPECT_EQ(judged_partly(lost + unswitched_instance(30)).verdict("S1"), Verdict::inconclusive);
  EXPECT_EQ(judged_partly("\n5 kernel_lost 7" + instance(20, 120)).verdict("S1"), Verdict::fail);
}

TEST(PartOfTheRun, MayLackThePriorityThatWasSeenNowhere) {
  const auto early = instance(10, 120) + "\n15 kernel_ends" + unswitched_instance(20);
  EXPECT_EQ(judged_partly(early).verdict("S2"), Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
