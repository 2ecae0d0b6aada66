// `--window`: callbacks that ran, began or returned outside it, and threads that were gone before.
#include "windows.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

TEST(Window, ACallbackRanOutsideItIfItsTotalSaysSo) {
  auto trace = trace_of(R"(
    callback seldom
    callback often
    5 start seldom
    6 end seldom
    10 start often
    12 end often
    20 fini seldom
    30 start often
    32 end often)");
  trace.erase<CallbackStart>([](const auto&, const EventHead& head) { return head.time.ns == 5; });
  trace.erase<CallbackEnd>([](const auto&, const EventHead& head) { return head.time.ns == 6; });
  constexpr const char* kSpec = "callback_groups:\n  - {id: seldom}\n";
  EXPECT_EQ(Verified(trace, kSpec)["M1"], Verdict::pass);
  EXPECT_EQ(Verified(trace, kSpec, window(25, 40))["M1"], Verdict::pass);
  EXPECT_EQ(Verified(trace, kSpec, window(8, 15))["M1"], Verdict::pass);
}

TEST(Window, ARestartAfterItIsNoneOfItsConcern) {
  const auto judged = [](const std::string& period, const std::string& applied, std::int64_t to) {
    return in_window(R"(
    process first until=100
    callback a id=/n@Timer timer period=10
    process second pid=200 from=1000
    callback b id=/n@Timer timer period=)" +
                         period + R"(
    1 initial a
    2 applied a policy=fifo priority=50
    10 start a
    12 end a
    1150 begin b
    1151 initial b
    1152 applied b )" + applied +
                         R"(
    1160 start b
    1162 end b)",
                     5, to)["M5"];
  };
  constexpr const char* kAlike = "policy=fifo priority=50";
  EXPECT_EQ(judged("10", kAlike, 1200), Verdict::pass);
  EXPECT_EQ(judged("10", "policy=other", 1200), Verdict::fail);
  EXPECT_EQ(judged("20", kAlike, 1200), Verdict::fail);
  EXPECT_EQ(judged("10", "policy=other", 500), Verdict::not_applicable);
  EXPECT_EQ(judged("20", kAlike, 500), Verdict::not_applicable);
  EXPECT_EQ(judged("10", "policy=other", 1120), Verdict::inconclusive) << "it got its thread later";
}

// The second callback is registered at 47.
TextTrace with_late_callback(const std::string& first, const std::string& second) {
  auto trace =
      trace_of("group both\ncallback a id=/n@Timer(10) " + first + "\ncallback b id=" + second + R"(
    10 start a
    12 end a
    47 init b
    50 start b on=a
    52 end b on=a)");
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return e.callback == CallbackId{1} && head.time.ns < 0;
  });
  return trace;
}

TEST(Window, ACallbackThatIsRegisteredAfterItIsNoneOfItsConcern) {
  const auto namesakes = with_late_callback("", "/n@Timer(10) pooled");
  EXPECT_EQ(Verified(namesakes)["M7"], Verdict::fail);
  EXPECT_EQ(Verified(namesakes, {}, window(0, 48))["M7"], Verdict::fail);
  EXPECT_EQ(Verified(namesakes, {}, window(0, 40))["M7"], Verdict::pass);
  const auto group = with_late_callback("group=both", "/n@Timer(20) group=both pooled");
  EXPECT_EQ(Verified(group)["M8"], Verdict::fail);
  EXPECT_EQ(Verified(group, {}, window(0, 48))["M8"], Verdict::fail);
  EXPECT_EQ(Verified(group, {}, window(0, 40))["M8"], Verdict::pass);
}

TEST(Window, AThreadThatEndedBeforeItIsNoneOfItsConcern) {
  constexpr const char* kTrace = R"(
    process first until=30
    callback a
    process second pid=200 from=1000
    callback b
    1 initial a
    2 applied a policy=fifo priority=50
    10 start a
    12 end a
    20 audit a policy=fifo priority=50
    1101 initial b
    1102 applied b policy=fifo priority=50
    1110 start b
    1112 end b
    1120 audit b policy=fifo priority=50)";
  EXPECT_EQ(in_window(kTrace, 0, 1200)["S3"], Verdict::pass);
  EXPECT_EQ(in_window(kTrace, 25, 1200)["S3"], Verdict::inconclusive)
      << "the audit at 20 was before";
  EXPECT_EQ(in_window(kTrace, 500, 1200)["S3"], Verdict::pass);
}

// `a` starts on CPU 0, once its thread was switched in; that of `b` has the other CPU.
constexpr const char* kOneStarted = R"(
    kernel
    callback a
    callback b cpu=1
    1 switch 0 idle a
    2 switch 0 a idle state=1
    20 switch 0 idle a
    22 start a
)";
constexpr const char* kBudgetOfA =
    "callback_groups:\n  - {id: a, foreign_work_budget: 100000000}\n";

// The thread that it began on is free then, whichever thread tells its end.
TEST(Window, AnInstanceThatBeganBeforeItEndsOnItsThreadWhereAnotherOneTellsThat) {
  const auto ended_on = [](const std::string& thread) {
    const auto trace = std::string(kOneStarted) + R"(
      24 switch 1 idle b
      30 end a on=)" + thread +
                       R"(
      32 switch 0 a idle state=1
      33 switch 1 b idle state=1
      40 switch 0 idle a
      50 switch 0 a idle state=1
      52 switch 1 idle b
      53 start b
      54 end b)";
    return in_window(trace, 25, 60, kBudgetOfA).of("M6", "thread 101");
  };
  EXPECT_EQ(ended_on("a"), Verdict::fail) << "10 of 28";
  EXPECT_EQ(ended_on("b"), Verdict::fail);
}

TEST(Window, AThreadThatWasOverBeforeItDoesNoForeignWorkInIt) {
  const auto trace = std::string(kOneStarted) + R"(
    30 end a
    31 finish a
    32 switch 0 a idle state=64
    40 switch 1 idle b
    42 start b
    50 end b
    51 switch 1 b idle state=1)";
  EXPECT_EQ(in_window(trace, 0, 60, kBudgetOfA)["M6"], Verdict::fail) << "3 of 29";
  const auto later = in_window(trace, 35, 60, kBudgetOfA);
  for (const auto& rule : later.result.verdicts.rules)
    EXPECT_NE(rule.verdict, Verdict::fail) << rule.id;
}

}  // namespace
}  // namespace cie::test
