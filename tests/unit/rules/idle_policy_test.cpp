// SCHED_IDLE: its nice value means nothing to the kernel, which keeps two of them: the one that sched_getattr() tells is
// of before, the one behind the priority of sched_switch was given with the policy.
#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

Verified judged(const std::string& lines) {
  return Verified("callback fusion\n-100 initial fusion\n-90 applied fusion policy=idle nice=10\n" +
                  lines + "\n10 start fusion\n12 end fusion\n20 start fusion\n22 end fusion");
}

TEST(IdlePolicy, AuditsMayTellAnyNiceValue) {
  EXPECT_EQ(judged("30 audit fusion policy=idle nice=0")["S3"], Verdict::pass);
  EXPECT_EQ(judged("30 audit fusion policy=other nice=10")["S3"], Verdict::fail);
}

TEST(IdlePolicy, SwitchesMayShowAnyNiceValue) {
  const std::string audit = "30 audit fusion policy=idle nice=10\n";
  for (const auto* prio : {"120", "130", "139"}) {
    EXPECT_EQ(judged(audit + "9 switch 0 idle fusion next_prio=" + prio)["S3"], Verdict::pass)
        << prio;
  }
  const auto raised = judged(audit + "9 switch 0 idle fusion next_prio=79");
  EXPECT_EQ(raised["S3"], Verdict::fail);
  EXPECT_THAT(raised.evidence("S3", "thread 101"), HasSubstr("real-time priority 20"));
}

// A waiter of SCHED_FIFO 20 lends its priority, and the idle thread returns to its own.
TEST(IdlePolicy, InheritsAndReturns) {
  const std::string lent =
      "30 audit fusion policy=idle nice=10\n8 boost fusion prio=79 old=120\n"
      "9 switch 0 idle fusion next_prio=79\n13 boost fusion prio=120 old=79\n"
      "14 switch 0 fusion idle prio=120\n";
  EXPECT_EQ(judged(lent + "19 switch 0 idle fusion next_prio=120")["S3"], Verdict::pass);
  EXPECT_EQ(judged(lent + "19 switch 0 idle fusion next_prio=79")["S3"], Verdict::fail);
}

TEST(IdlePolicy, MayReturnWithAnotherNiceValue) {
  const auto restarted = [](const std::string& parameters) {
    return Verified(
        "process first pid=100 until=100\ncallback a id=/n@Timer timer period=10\n"
        "process second pid=200 from=1000\ncallback b id=/n@Timer timer period=10\n"
        "1 initial a\n2 applied a policy=idle nice=0\n10 start a\n12 end a\n"
        "1101 initial b\n1102 applied b " +
        parameters + "\n1110 start b\n1112 end b")["M5"];
  };
  EXPECT_EQ(restarted("policy=idle nice=5"), Verdict::pass);
  EXPECT_EQ(restarted("policy=batch nice=0"), Verdict::fail);
}

// SCHED_EXT has a nice value, and sched_switch tells it.
TEST(ExtPolicy, IsScheduledWithItsNiceValue) {
  const std::string callback =
      "callback fusion\n-100 initial fusion\n-90 applied fusion policy=ext nice=5\n"
      "10 start fusion\n12 end fusion\n20 start fusion\n22 end fusion\n";
  const std::string audit = "30 audit fusion policy=ext nice=5\n";
  EXPECT_EQ(Verified(callback + audit + "9 switch 0 idle fusion next_prio=125")["S3"],
            Verdict::pass);
  const Verified other(callback + audit + "9 switch 0 idle fusion next_prio=120");
  EXPECT_EQ(other["S3"], Verdict::fail);
  EXPECT_THAT(other.evidence("S3", "thread 101"), HasSubstr("applied: policy 7 nice 5"));
  const Verified reniced(callback + "30 audit fusion policy=ext nice=0");
  EXPECT_EQ(reniced["S3"], Verdict::fail);
  EXPECT_THAT(reniced.evidence("S3", "thread 101"), HasSubstr("policy 7 nice 0"));
}

}  // namespace
}  // namespace cie::test
