// Whether real-time parameters went on to threads that were not given them.
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(NoParameterLeak, FailsWhenAThreadBeginsRealTime) {
  constexpr auto kLeak = R"(
    callback fusion
    thread helper worker
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    5 begin helper
    6 initial helper policy=fifo priority=80
    10 start fusion
    12 end fusion)";
  const Verified verified(kLeak);
  EXPECT_EQ(verified.of("S5", "thread 102"), Verdict::fail);
  EXPECT_EQ(verified.of("S5", "thread 101"), Verdict::pass);
  EXPECT_THAT(verified.evidence("S5", "thread 101"), HasSubstr("announced only"));
}

TEST(NoParameterLeak, FailsForAnUnannouncedChildOfARealTimeThread) {
  constexpr auto kFork = R"(
    callback fusion
    thread child worker silent tid=150
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    3 switch 0 idle fusion next_prio=19
    5 fork fusion child
    7 switch 1 idle child next_prio=19
    10 start fusion
    12 end fusion)";
  const Verified verified(kFork);
  EXPECT_EQ(verified.of("S5", "thread 150"), Verdict::fail);
  EXPECT_THAT(verified.evidence("S5", "thread 150"),
              AllOf(HasSubstr("5 sched_process_fork"), HasSubstr("7 sched_switch")));
  auto reset = std::string(kFork);
  reset.replace(reset.find("7 switch 1 idle child next_prio=19"), 35,
                "7 switch 1 idle child next_prio=120\n");
  EXPECT_EQ(Verified(reset).of("S5", "thread 150"), Verdict::pass);
}

// At 9 its creator runs through a mutex: nobody inherits that (sched_fork(): p->prio = current->normal_prio).
TEST(NoParameterLeak, DoesNotJudgeAChildWithThePriorityThatItsCreatorInherited) {
  const auto child_at = [](const std::string& prio) {
    return Verified(R"(
    callback fusion
    thread child worker silent tid=150
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    3 switch 0 idle fusion next_prio=19
    4 boost fusion prio=9 old=19
    4 switch 0 fusion idle prio=9
    4 switch 0 idle fusion next_prio=9
    5 fork fusion child
    7 switch 1 idle child next_prio=)" +
                    prio + R"(
    10 start fusion
    12 end fusion)");
  };
  EXPECT_EQ(child_at("9").of("S5", "thread 150"), Verdict::not_applicable);
  EXPECT_EQ(child_at("9").of("S5", "thread 101"), Verdict::pass);
  EXPECT_EQ(child_at("19").of("S5", "thread 150"), Verdict::fail);
}

// What a child inherits is its creator's own priority (sched_fork(): p->prio = current->normal_prio). With another one
// it was given that before it ran, as pthread_attr_setschedparam() does, or its creator changed its own.
TEST(NoParameterLeak, DoesNotJudgeAChildWithAnotherRealTimePriority) {
  const auto verified = [](const std::string& read_back, int child, const std::string& hole = {}) {
    return Verified(R"(
    callback fusion
    thread child worker silent tid=150
    -100 initial fusion
    -90 applied fusion policy=fifo )" +
                    read_back + R"(
    3 switch 0 idle fusion next_prio=19
    5 fork fusion child
    )" + hole + R"(
    7 switch 1 idle child next_prio=)" +
                    std::to_string(child) + R"(
    10 start fusion
    12 end fusion)");
  };
  const auto given = verified("priority=80", 49);
  EXPECT_EQ(given["S5"], Verdict::pass);
  EXPECT_THAT(given.evidence("S5", "thread 101"),
              AllOf(HasSubstr("7 sched_switch"), HasSubstr("not judged: its child thread 150")));
  // What a hole hides may have been its first run.
  const auto after_a_hole = verified("priority=80", 49, "6 discard kernel until=7 count=1");
  EXPECT_THAT(after_a_hole.evidence("S5", "thread 101"), testing::Not(HasSubstr("not judged")));
  EXPECT_EQ(verified("priority=80", 19).of("S5", "thread 150"), Verdict::fail);
  // Its creator was boosted while somebody waited for it: inherited is what it was read back with.
  EXPECT_EQ(verified("priority=50", 49).of("S5", "thread 150"), Verdict::fail);
}

// Whoever configures itself and then creates a helper was not switched in between.
TEST(NoParameterLeak, KnowsWhatACreatorWasReadBackWithSinceItsLastSwitch) {
  constexpr auto kFork = R"(
    callback fusion
    thread child worker silent tid=150
    -100 initial fusion
    -95 switch 0 idle fusion
    -90 applied fusion policy=fifo priority=80
    5 fork fusion child
    7 switch 1 idle child next_prio=19
    10 start fusion
    12 end fusion)";
  EXPECT_EQ(Verified(kFork).of("S5", "thread 150"), Verdict::fail);
}

TEST(NoParameterLeak, FailsAfterHoweverManyChildrenWithoutAPriority) {
  std::string trace = R"(
    callback fusion
    thread child worker silent tid=150
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    3 switch 0 idle fusion next_prio=19)";
  constexpr int kChildren = 66'000;
  for (int i = 0; i < kChildren; ++i) {
    trace += '\n' + std::to_string(10 * i + 5) + " fork fusion child\n" +
             std::to_string(10 * i + 7) + " switch 1 idle child next_prio=120\n" +
             std::to_string(10 * i + 8) + " switch 1 child idle";
  }
  trace += R"(
    2000000 fork fusion child
    2000007 switch 1 idle child next_prio=19
    2000010 start fusion
    2000012 end fusion)";
  const Verified verified(trace);
  EXPECT_EQ(verified["S5"], Verdict::fail);
  EXPECT_LT(verified.rule("S5").subjects.size(), std::size_t{kChildren});
}

// The kernel gives a tid again: what a child did that held it before is not its successor's.
TEST(NoParameterLeak, JudgesAThreadByItsOwnCreation) {
  const Verified verified(R"(
    callback fusion
    thread shell worker silent tid=150
    thread normal worker silent tid=151
    thread helper worker tid=150
    -100 initial fusion
    -90 applied fusion policy=fifo priority=80
    3 switch 0 idle fusion next_prio=19
    5 fork fusion shell
    7 switch 1 idle shell next_prio=19
    8 switch 1 shell normal next_prio=120
    9 exit shell
    20 fork normal helper
    21 switch 1 normal helper next_prio=120
    22 begin helper
    23 initial helper
    30 start fusion
    32 end fusion)");
  std::vector<Verdict> of_150;
  for (const auto& subject : verified.rule("S5").subjects) {
    if (subject.subject == "thread 150") of_150.push_back(subject.verdict);
  }
  EXPECT_THAT(of_150, testing::UnorderedElementsAre(Verdict::fail, Verdict::pass));
}

TEST(NoParameterLeak, AppliesOnlyWithRealTimeThreads) {
  EXPECT_EQ(Verified("callback a\n1 start a\n2 end a")["S5"], Verdict::not_applicable);
}

}  // namespace
}  // namespace cie::test
