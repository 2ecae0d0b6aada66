#include "support/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

std::string restarted(const std::string& before, const std::string& after,
                      const std::string& second = "timer period=10") {
  return "process first pid=100 until=100\n"
         "callback a id=/n@Timer timer period=10\n"
         "process second pid=200 from=1000\n"
         "callback b id=/n@Timer " +
         second +
         "\n"
         "1 initial a\n2 applied a " +
         before +
         "\n10 start a\n12 end a\n"
         "1101 initial b\n1102 applied b " +
         after + "\n1110 start b\n1112 end b";
}

constexpr const char* kLater = "callback /n@Timer (pid 200)";

TEST(MappingSurvivesRestart, PassesWhenTheCallbackReturnsAsItWas) {
  const Verified verified(restarted("policy=fifo priority=50", "policy=fifo priority=50"));
  EXPECT_EQ(verified.of("M5", kLater), Verdict::pass);
  EXPECT_EQ(verified.rule("M5").subjects.size(), 1U);
}

TEST(MappingSurvivesRestart, FailsWhenParametersChanged) {
  const Verified verified(restarted("policy=fifo priority=50", "policy=other"));
  EXPECT_EQ(verified.of("M5", kLater), Verdict::fail);
  EXPECT_THAT(verified.evidence("M5", kLater),
              AllOf(HasSubstr("2 thread_sched was: SCHED_FIFO 50 on CPUs 0,1"),
                    HasSubstr("1102 thread_sched is: SCHED_OTHER nice 0 on CPUs 0,1")));
  EXPECT_EQ(Verified(restarted("cpus=0", "cpus=1")).of("M5", kLater), Verdict::fail);
}

TEST(MappingSurvivesRestart, FailsWhenThePropertiesChanged) {
  const Verified verified(restarted("", "", "timer period=20"));
  EXPECT_EQ(verified.of("M5", kLater), Verdict::fail);
  EXPECT_THAT(verified.evidence("M5", kLater), HasSubstr("is: timer, period 20 ns"));
}

TEST(MappingSurvivesRestart, IsInconclusiveWhenALaterReadBackWasLost) {
  auto trace = trace_of(
      restarted("policy=fifo priority=50", "policy=other\n1105 applied b policy=fifo priority=50"));
  trace.erase<ThreadSched>(
      [](const ThreadSched& e, const EventHead& head) { return e.n == 2 && head.pid == 200; });
  EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive) << "no false FAIL";
}

TEST(MappingSurvivesRestart, IsInconclusiveWithoutALogicalId) {
  auto trace = trace_of(restarted("", ""));
  trace.erase<CallbackInit>(
      [](const CallbackInit&, const EventHead& head) { return head.pid == 200; });
  EXPECT_EQ(Verified(trace)["M5"], Verdict::inconclusive);
}

TEST(MappingSurvivesRestart, ComparesOnlyLifetimesThatFollowEachOther) {
  EXPECT_EQ(Verified("process first pid=100\ncallback a id=/n@Timer\n"
                     "process second pid=200\ncallback b id=/n@Timer period=20\n"
                     "1 start a\n2 end a\n3 start b\n4 end b")["M5"],
            Verdict::not_applicable);
}

}  // namespace
}  // namespace cie::test
