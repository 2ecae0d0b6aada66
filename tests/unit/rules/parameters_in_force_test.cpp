// S1 asks of each instance what was in force when it started: the last `applied` or audit before it.
#include "support/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kAsksForFifo =
    "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 80}\n";
constexpr const char* kFusion = "callback fusion";

// Applied as specified, and once more at 50; `between` comes after an instance of 10, and brings so many
// changes.
std::string changed_and_back(const std::string& between, const std::string& changes = "0") {
  return "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n"
         "10 start fusion\n12 end fusion\n" +
         between + "\n50 applied fusion policy=fifo priority=80 change=" + changes +
         "\n60 start fusion\n62 end fusion\n"
         "70 audit fusion policy=fifo priority=80 change=" +
         changes;
}

constexpr const char* kTwoInstances =
    "\n30 start fusion\n32 end fusion\n40 start fusion\n42 end fusion";

TEST(ParametersInForce, AreAskedOfEachInstance) {
  const Verified verified(
      changed_and_back("20 applied fusion policy=fifo priority=10" + std::string(kTwoInstances)),
      kAsksForFifo);
  EXPECT_EQ(verified.of("S1", kFusion), Verdict::fail);
  EXPECT_THAT(verified.evidence("S1", kFusion),
              AllOf(HasSubstr("20 thread_sched spec.yaml:2 asks for SCHED_FIFO 80"),
                    HasSubstr("the thread ran SCHED_FIFO 10"),
                    HasSubstr("40 callback_start fusion started then (seq 2); 2 instances did")));
  EXPECT_EQ(verified["S2"], Verdict::pass);
  EXPECT_EQ(verified["S3"], Verdict::pass);
}

TEST(ParametersInForce, AreThoseOfTheLastAuditToo) {
  EXPECT_EQ(Verified(changed_and_back("20 audit fusion policy=fifo priority=10" +
                                      std::string(kTwoInstances)),
                     kAsksForFifo)["S1"],
            Verdict::fail);
}

TEST(ParametersInForce, AreNotAskedForWhereNoInstanceStarts) {
  EXPECT_EQ(
      Verified(changed_and_back("20 applied fusion policy=fifo priority=10"), kAsksForFifo)["S1"],
      Verdict::pass);
}

TEST(ParametersInForce, UntilTheEndOfTheRunCount) {
  const Verified verified(
      "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n"
      "10 start fusion\n12 end fusion\n20 audit fusion policy=fifo priority=10" +
          std::string(kTwoInstances),
      kAsksForFifo);
  EXPECT_EQ(verified["S1"], Verdict::fail);
}

// S2's.
TEST(ParametersInForce, AreNotAskedForBeforeTheFirstThatMatch) {
  const Verified verified(
      "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=10\n"
      "10 start fusion\n12 end fusion\n50 applied fusion policy=fifo priority=80\n"
      "60 start fusion\n62 end fusion",
      kAsksForFifo);
  EXPECT_EQ(verified["S1"], Verdict::pass);
  EXPECT_EQ(verified["S2"], Verdict::fail);
}

// From the audit that announces a change to the next `applied` the thread may run as either says.
TEST(ParametersInForce, AreNotKnownWhileTheyChange) {
  EXPECT_EQ(Verified(changed_and_back("20 audit fusion policy=fifo priority=10 change=1\n" +
                                          std::string(kTwoInstances) +
                                          "\n45 applied fusion policy=fifo priority=80 change=1",
                                      "1"),
                     kAsksForFifo)["S1"],
            Verdict::pass);
}

// A reload to another spec, and back.
TEST(ParametersInForce, AreAskedForByTheSpecThatTheProcessHadThen) {
  const std::string sha256 = SchedulingSpec::parse(kAsksForFifo, "").sha256();
  const auto reloaded = [&](const std::string& to) {
    return Verified("process app spec=" + sha256 + "\n" +
                        changed_and_back("19 audit fusion policy=fifo priority=80 change=1\n"
                                         "20 applied fusion policy=fifo priority=10 change=1\n"
                                         "21 reload app spec=" +
                                             to + kTwoInstances +
                                             "\n48 audit fusion policy=fifo priority=10 change=2\n"
                                             "49 applied fusion policy=fifo priority=80 change=2\n"
                                             "55 reload app spec=" +
                                             sha256,
                                         "2"),
                    kAsksForFifo)["S1"];
  };
  EXPECT_EQ(reloaded("other"), Verdict::pass);
  EXPECT_EQ(reloaded(sha256), Verdict::fail) << "it had no other one";
}

TEST(ParametersInForce, AreUnknownWhereAReadBackIsLost) {
  auto trace = trace_of(
      changed_and_back("20 applied fusion policy=fifo priority=10" + std::string(kTwoInstances)));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 2; });
  EXPECT_EQ(Verified(trace, kAsksForFifo)["S1"], Verdict::inconclusive);
}

// Whether they were as specified again when the instances started is not known.
TEST(ParametersInForce, AreUnknownWhereALaterReadBackIsLost) {
  auto trace =
      trace_of(changed_and_back("20 applied fusion policy=fifo priority=10\n"
                                "25 applied fusion policy=fifo priority=80" +
                                std::string(kTwoInstances)));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 3; });
  EXPECT_EQ(Verified(trace, kAsksForFifo)["S1"], Verdict::inconclusive);
}

TEST(ParametersInForce, KeepTheirWitnessWhereAnotherReadBackIsLost) {
  auto trace = trace_of(changed_and_back("20 applied fusion policy=fifo priority=10" +
                                         std::string(kTwoInstances) +
                                         "\n44 audit fusion policy=fifo priority=10"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 4; });
  EXPECT_EQ(Verified(trace, kAsksForFifo)["S1"], Verdict::fail);
}

TEST(ParametersInForce, AreUnknownWhereTheInstancesAreLost) {
  auto trace = trace_of(
      changed_and_back("20 applied fusion policy=fifo priority=10" + std::string(kTwoInstances)));
  const auto is_between = [](const auto& event, const EventHead&) {
    return event.seq == 1 || event.seq == 2;
  };
  trace.erase<CallbackStart>(is_between);
  trace.erase<CallbackEnd>(is_between);
  EXPECT_EQ(Verified(trace, kAsksForFifo)["S1"], Verdict::inconclusive);
}

// begin_change() without an `applied`: the thread may run as anything since.
TEST(AChange, ThatDidNotEndPassesNothing) {
  const auto judged = [](const std::string& change) {
    return Verified(
        "callback fusion\n-100 initial fusion\n-90 applied fusion policy=fifo priority=80\n"
        "10 start fusion\n12 end fusion\n15 audit fusion policy=fifo priority=80\n" +
            change + "20 start fusion\n22 end fusion",
        kAsksForFifo);
  };
  for (const auto* rule : {"S1", "S3", "S4"}) {
    EXPECT_EQ(judged("")[rule], Verdict::pass) << rule;
    EXPECT_EQ(judged("18 audit fusion policy=fifo priority=80 change=1\n")[rule],
              Verdict::inconclusive)
        << rule;
  }
}

TEST(AChange, ThatDidNotEndTakesNoWitness) {
  const Verified verified(
      changed_and_back("20 applied fusion policy=fifo priority=10" + std::string(kTwoInstances)) +
          "\n80 audit fusion policy=fifo priority=80 change=1",
      kAsksForFifo);
  EXPECT_EQ(verified["S1"], Verdict::fail);
}

}  // namespace
}  // namespace cie::test
