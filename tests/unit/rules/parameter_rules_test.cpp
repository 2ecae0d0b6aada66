#include "support/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kFifo80 = R"(callback_groups:
  - id: fusion
    policy: SCHED_FIFO
    priority: 80
    affinity: [1]
)";

std::string run_with(const std::string& read_backs) {
  return "callback fusion\n-100 initial fusion\n" + read_backs +
         "\n10 start fusion\n12 end fusion\n20 start fusion\n22 end fusion";
}

struct Applied {
  const char* spec;
  const char* read_back;
  Verdict verdict;
};

class ParametersAsSpecified : public testing::TestWithParam<Applied> {};

TEST_P(ParametersAsSpecified, ComparesWhatThePolicyUses) {
  const auto spec = std::string("callback_groups:\n  - id: fusion\n") + GetParam().spec;
  const auto text = run_with(std::string("-90 applied fusion ") + GetParam().read_back);
  EXPECT_EQ(Verified(text, spec).of("S1", "callback fusion"), GetParam().verdict)
      << GetParam().spec << GetParam().read_back;
}

INSTANTIATE_TEST_SUITE_P(
    Policies, ParametersAsSpecified,
    testing::Values(
        Applied{"    policy: SCHED_FIFO\n    priority: 80\n", "policy=fifo priority=80",
                Verdict::pass},
        Applied{"    policy: SCHED_FIFO\n    priority: 80\n", "policy=fifo priority=79",
                Verdict::fail},
        Applied{"    policy: SCHED_FIFO\n    priority: 80\n", "policy=rr priority=80",
                Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n    nice: -5\n", "policy=other nice=-5", Verdict::pass},
        Applied{"    policy: SCHED_OTHER\n    nice: -5\n", "policy=other nice=0", Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n    nice: -5\n", "policy=batch nice=-5", Verdict::fail},
        Applied{"    policy: SCHED_IDLE\n", "policy=idle nice=3", Verdict::pass},
        Applied{"    policy: SCHED_DEADLINE\n    runtime: 2000\n    deadline: 3000\n"
                "    period: 4000\n",
                "policy=deadline runtime=2000 deadline=3000 period=4000", Verdict::pass},
        Applied{"    policy: SCHED_DEADLINE\n    runtime: 2000\n    deadline: 3000\n"
                "    period: 4000\n",
                "policy=deadline runtime=2000 deadline=3000 period=4001", Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n    slice: 100000\n", "policy=other slice=100000",
                Verdict::pass},
        Applied{"    policy: SCHED_OTHER\n    slice: 100000\n", "policy=other slice=2800000",
                Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n    slice: 100000\n", "policy=other old",
                Verdict::inconclusive},
        Applied{"    policy: SCHED_OTHER\n    slice: 100000\n", "policy=batch old", Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n", "policy=other slice=2800000", Verdict::pass},
        Applied{"    policy: SCHED_OTHER\n    uclamp_min: 200\n    uclamp_max: 800\n",
                "policy=other util_min=200 util_max=800", Verdict::pass},
        Applied{"    policy: SCHED_OTHER\n    uclamp_max: 800\n", "policy=other util_max=801",
                Verdict::fail},
        Applied{"    policy: SCHED_OTHER\n    uclamp_min: 0\n", "policy=other util_max=0",
                Verdict::fail},  // a kernel without clamps reports 0 for both
        Applied{"    policy: SCHED_OTHER\n    uclamp_min: 0\n", "policy=other old",
                Verdict::inconclusive},
        Applied{"    affinity: [1]\n", "policy=fifo priority=3 cpus=1", Verdict::pass},
        Applied{"    affinity: [1]\n", "policy=fifo priority=3 cpus=0,1", Verdict::fail},
        Applied{"    wcet: 5\n", "policy=fifo priority=3", Verdict::not_applicable}));

TEST(ParametersAsSpecifiedEvidence, SaysWhatWasAskedForAndWhatRuns) {
  const Verified verified(run_with("-90 applied fusion error=1"), kFifo80);
  EXPECT_THAT(
      verified.evidence("S1", "callback fusion"),
      HasSubstr(
          "-90 thread_sched spec.yaml:2 asks for SCHED_FIFO 80 on CPUs 1; the thread "
          "runs SCHED_OTHER nice 0 on CPUs 0,1 (the request failed with EPERM: Operation not permitted)"));
  const auto subject = verified.on("S1", "callback fusion");
  const auto* failed = analysis::find_note(subject.evidence.at(0).note, "request-failed");
  ASSERT_NE(failed, nullptr);
  const auto* error = analysis::find_argument(*failed, "errno");
  ASSERT_NE(error, nullptr);
  EXPECT_EQ(error->value, analysis::Argument("errno", 1).value);  // EPERM
}

TEST(ParametersAsSpecifiedEvidence, JudgesTheLastApplied) {
  EXPECT_EQ(Verified(run_with("-90 applied fusion\n"
                              "-80 applied fusion policy=fifo priority=80 cpus=1"),
                     kFifo80)["S1"],
            Verdict::pass);
}

TEST(ParametersAsSpecifiedEvidence, TellsALaterReadBackApartFromWhatWasApplied) {
  const std::string applied = "-90 applied fusion policy=fifo priority=10 cpus=1\n";
  const auto evidence = [&](const std::string& later) {
    return Verified(run_with(applied + later), kFifo80).evidence("S1", "callback fusion");
  };
  EXPECT_THAT(evidence("30 audit fusion policy=fifo priority=80 cpus=1"),
              HasSubstr("asks for SCHED_FIFO 80 on CPUs 1; applied to the thread was SCHED_FIFO 10 "
                        "on CPUs 1, and read back later was SCHED_FIFO 80 on CPUs 1"));
  EXPECT_THAT(evidence("30 audit fusion policy=fifo priority=10 cpus=1"),
              HasSubstr("; the thread runs SCHED_FIFO 10 on CPUs 1\n"));
}

TEST(ParametersAsSpecifiedEvidence, IsOfWhatTheReportSaysWasApplied) {
  const auto report = analyze(trace_of(run_with("-90 applied fusion policy=fifo priority=10\n"
                                                "30 audit fusion policy=fifo priority=20")))
                          .report;
  ASSERT_EQ(report.threads.size(), 1U);
  EXPECT_EQ(report.threads[0].applied->priority, 10U);
  EXPECT_EQ(report.threads[0].sched->priority, 20U);
}

TEST(ParametersAsSpecifiedEvidence, IsInconclusiveWithoutReadBack) {
  EXPECT_EQ(Verified(run_with(""), kFifo80)["S1"], Verdict::inconclusive);
}

TEST(ParametersAsSpecifiedEvidence, IsInconclusiveWhenALaterReadBackWasLost) {
  auto trace =
      trace_of(run_with("-90 applied fusion\n"
                        "-80 applied fusion policy=fifo priority=80 cpus=1\n"
                        "30 audit fusion policy=fifo priority=80 cpus=1"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 2; });
  EXPECT_EQ(Verified(trace, kFifo80)["S1"], Verdict::inconclusive) << "no false FAIL";
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 3; });
  EXPECT_EQ(Verified(trace, kFifo80)["S1"], Verdict::inconclusive) << "the totals tell";
}

TEST(ParametersAsSpecifiedEvidence, KeepsItsFailureWhenOnlyAnEarlierReadBackWasLost) {
  auto trace = trace_of(run_with("-90 applied fusion\n-80 applied fusion"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 0; });
  EXPECT_EQ(Verified(trace, kFifo80)["S1"], Verdict::fail);
}

TEST(ParametersAsSpecifiedEvidence, JudgesNamedWorkers) {
  const Verified verified(
      "thread recv worker\ncallback fusion\n-100 initial recv\n-90 applied recv\n"
      "1 start fusion\n2 end fusion",
      "non_ros_threads:\n  - name: recv\n    policy: SCHED_FIFO\n    priority: 70\n");
  EXPECT_EQ(verified.of("S1", "thread 101"), Verdict::fail);
}

// Its own thread is as specified, and idle.
TEST(ParametersAsSpecifiedEvidence, JudgesTheThreadThatRanTheCallbackInPlaceOfItsOwn) {
  for (const std::string role : {"worker", "pool", "dispatcher"}) {
    const auto judged = [&role](const std::string& read_back) {
      return Verified("thread w " + role + " tid=150\n" + "callback fusion\n-100 initial fusion\n" +
                          "-90 applied fusion policy=fifo priority=80 cpus=1\n" + read_back +
                          "\n1 start fusion on=w\n2 end fusion on=w",
                      kFifo80);
    };
    const auto other = judged("-80 initial w policy=other");
    EXPECT_EQ(other.of("S1", "callback fusion"), Verdict::fail) << role;
    EXPECT_THAT(
        other.evidence("S1", "callback fusion"),
        HasSubstr("1 callback_start fusion ran 1 time on thread 150 \"w\", which is not its"));
    EXPECT_NE(other["S2"], Verdict::pass) << role;
    EXPECT_EQ(judged("-80 applied w policy=fifo priority=80 cpus=1")["S1"], Verdict::pass) << role;
  }
}

// An executor gives an entry's parameters to whatever thread of its own has that name.
TEST(ParametersAsSpecifiedEvidence, JudgesPoolsAndDispatchersThatAnEntryNames) {
  for (const std::string role : {"pool", "dispatcher"}) {
    const auto judged = [&role](const std::string& applied) {
      return Verified("thread t1 " + role + " tid=150\ncallback fusion\n-100 initial t1\n" +
                          "-90 applied t1 " + applied + "\n1 start fusion\n2 end fusion",
                      "non_ros_threads:\n  - name: t1\n    policy: SCHED_FIFO\n    priority: 4\n")
          .of("S1", "thread 150");
    };
    EXPECT_EQ(judged("policy=fifo priority=3"), Verdict::fail) << role;
    EXPECT_EQ(judged("policy=fifo priority=4"), Verdict::pass) << role;
  }
}

TEST(ParametersAsSpecifiedEvidence, TakesTheFirstAuditOfAnAttachedProcess) {
  EXPECT_EQ(Verified("process app attached\ncallback fusion next=3\n10 start fusion\n12 end fusion",
                     "callback_groups:\n  - id: fusion\n    policy: SCHED_OTHER\n")["S1"],
            Verdict::pass);
}

// The thread that replaced the first one ran the callback twice before it was configured.
TEST(ParametersBeforeFirstCallback, JudgesAThreadThatReplacedTheFirstOne) {
  const auto judged = [](const std::string& applied_at) {
    return Verified(
        "callback fusion pooled\nthread t1 callback of=fusion tid=101\n"
        "thread t2 callback of=fusion tid=102\n-500 begin t1\n-90 initial t1\n"
        "-80 applied t1 policy=fifo priority=80 cpus=1\n10 start fusion on=t1\n"
        "12 end fusion on=t1\n14 finish t1\n20 begin t2\n21 initial t2\n22 init fusion\n" +
            applied_at + " applied t2 policy=fifo priority=80 cpus=1\n" +
            "30 start fusion on=t2\n32 end fusion on=t2\n40 start fusion on=t2\n"
            "42 end fusion on=t2\n60 finish t2",
        kFifo80);
  };
  EXPECT_EQ(judged("25")["S2"], Verdict::pass);
  const auto late = judged("50");
  EXPECT_EQ(late["S2"], Verdict::fail);
  EXPECT_THAT(late.evidence("S2", "callback fusion"),
              HasSubstr("30 callback_start fusion started (seq 1) unconfigured; 2 instances did"));
}

TEST(ParametersBeforeFirstCallback, FailsAndCountsWhatRanUnconfigured) {
  const Verified late(run_with("15 applied fusion policy=fifo priority=80 cpus=1"), kFifo80);
  EXPECT_EQ(late.of("S2", "callback fusion"), Verdict::fail);
  EXPECT_THAT(
      late.evidence("S2", "callback fusion"),
      AllOf(HasSubstr("10 callback_start fusion started (seq 0) unconfigured; 1 instance did"),
            HasSubstr("15 thread_sched")));
  EXPECT_THAT(Verified(run_with("30 applied fusion policy=fifo priority=80 cpus=1"), kFifo80)
                  .evidence("S2", "callback fusion"),
              HasSubstr("unconfigured; 2 instances did"));
  EXPECT_EQ(Verified(run_with("5 applied fusion policy=fifo priority=80 cpus=1"), kFifo80)["S2"],
            Verdict::pass);
}

// A reload of another spec: seq 0 ran as the former one said.
std::string reloaded_with(const std::string& sha256) {
  return "process app spec=former\n" +
         run_with(
             "-90 applied fusion\n"
             "15 audit fusion change=1\n"
             "16 applied fusion policy=fifo priority=80 cpus=1 change=1\n"
             "17 reload app spec=" +
             sha256);
}

TEST(Reload, IsJudgedByTheNewSpec) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  const Verified verified(reloaded_with(sha256), kFifo80);
  EXPECT_EQ(verified["S1"], Verdict::pass);
  EXPECT_EQ(verified["S2"], Verdict::not_applicable);
}

TEST(Reload, FailsByTheFormerSpecAndSaysThatAChangeCameLater) {
  const Verified verified(reloaded_with("another"),
                          "callback_groups:\n  - {id: fusion, policy: SCHED_OTHER}\n");
  EXPECT_EQ(verified["S1"], Verdict::fail);
  EXPECT_THAT(verified.evidence("S1", "callback fusion"),
              HasSubstr("(since change 1 of its parameters)"));
  EXPECT_EQ(verified["S2"], Verdict::pass);
}

// SCHED_OTHER without an error was not what this spec had asked for.
TEST(Reload, IsKnownByWhatTheThreadRanAsBefore) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  for (const std::string& erased : {std::string("former"), sha256}) {
    auto trace = trace_of(reloaded_with(sha256));
    trace.erase<RunBegin>(
        [&](const RunBegin& e, const EventHead&) { return e.spec_sha256 == erased; });
    EXPECT_EQ(Verified(trace, kFifo80)["S2"], Verdict::not_applicable) << erased;
  }
}

// The kernel leaves CPUs out where a cpuset has fewer, and reports no error.
TEST(Reload, IsInconclusiveWhereFewerCpusMayBeTheSameSpecs) {
  const char* const spec = "callback_groups:\n  - {id: fusion, affinity: [0, 1]}\n";
  const std::string sha256 = SchedulingSpec::parse(spec, "").sha256();
  const auto began_with = [&](const std::string& first) {
    return Verified("process app spec=" + first + "\n" +
                        run_with("-90 applied fusion cpus=0\n"
                                 "16 applied fusion cpus=0,1 change=1\n"
                                 "17 reload app spec=" +
                                 sha256),
                    spec)["S2"];
  };
  EXPECT_EQ(began_with("former"), Verdict::not_applicable);
  EXPECT_EQ(began_with(sha256), Verdict::inconclusive);
}

// The process died while its parameters changed.
TEST(Reload, ThatDidNotEndLeavesOpenWhatTheThreadRunsAs) {
  EXPECT_EQ(Verified("process app crash\n" + run_with("-90 applied fusion\n"
                                                      "30 audit fusion change=1"),
                     kFifo80)["S1"],
            Verdict::inconclusive);
}

// The process names the spec of its first executor, and the thread may be another one's.
TEST(Reload, MayBringASecondExecutorTheSpecThatTheRunBeganWith) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  const auto ran_before_with = [&](const char* error) {
    return Verified("process app spec=" + sha256 + "\n" +
                        run_with("-90 applied fusion error=" + std::string(error) +
                                 "\n16 applied fusion policy=fifo priority=80 cpus=1 change=1\n"
                                 "17 reload app spec=" +
                                 sha256),
                    kFifo80);
  };
  const auto unlike = ran_before_with("0");
  EXPECT_EQ(unlike["S1"], Verdict::pass);
  EXPECT_EQ(unlike["S2"], Verdict::not_applicable) << "a former spec asked for SCHED_OTHER";
  const auto refused = ran_before_with("1");
  EXPECT_EQ(refused["S2"], Verdict::inconclusive) << "whose spec was refused is not told";
  EXPECT_THAT(refused.evidence("S2", "callback fusion"),
              AllOf(HasSubstr("the request failed with EPERM"), HasSubstr("is unknown")));
}

TEST(Reload, BeforeTheFirstInstanceConfiguresIt) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  EXPECT_EQ(Verified("process app spec=former\n" +
                         run_with("-90 applied fusion\n"
                                  "5 applied fusion policy=fifo priority=80 cpus=1 change=1\n"
                                  "6 reload app spec=" +
                                  sha256),
                     kFifo80)["S2"],
            Verdict::pass);
}

TEST(ParametersBeforeFirstCallback, AppliesOnlyWhenSomeReadBackMatches) {
  EXPECT_EQ(Verified(run_with("-90 applied fusion"), kFifo80)["S2"], Verdict::not_applicable);
}

TEST(ParametersBeforeFirstCallback, IsInconclusiveWhenAnEarlierReadBackWasLost) {
  auto trace =
      trace_of(run_with("5 applied fusion policy=fifo priority=80 cpus=1\n"
                        "15 applied fusion policy=fifo priority=80 cpus=1"));
  trace.erase<ThreadSched>([](const ThreadSched& e, const EventHead&) { return e.n == 1; });
  EXPECT_EQ(Verified(trace, kFifo80)["S2"], Verdict::inconclusive) << "no false FAIL";
}

TEST(ParametersBeforeFirstCallback, IsInconclusiveWhenTheFirstStartWasLost) {
  auto trace = trace_of(run_with("5 applied fusion policy=fifo priority=80 cpus=1"));
  trace.erase<CallbackStart>([](const CallbackStart& e, const EventHead&) { return e.seq == 0; });
  EXPECT_EQ(Verified(trace, kFifo80)["S2"], Verdict::inconclusive);
}

TEST(ParametersBeforeFirstCallback, AppliesNotWhenTheFirstStartLiesBeforeTheWindow) {
  EXPECT_EQ(Verified("process app attached\ncallback fusion next=3\n10 start fusion\n12 end fusion",
                     "callback_groups:\n  - id: fusion\n    policy: SCHED_OTHER\n")["S2"],
            Verdict::not_applicable);
}

// A thread that ended at 20.
std::string ended(const std::string& spec, const std::string& reloads,
                  const std::string& applied = {}) {
  return "process app spec=" + spec + R"(
      callback fusion
      1 initial fusion
      2 applied fusion )" +
         applied + R"(
      10 start fusion
      12 end fusion
      20 finish fusion
      )" +
         reloads;
}
// Likewise, which was refused FIFO 80.
std::string refused_and_ended(const std::string& spec, const std::string& reloads) {
  return ended(spec, reloads, "error=1");
}

// What ended before the reload never had to do what it asks for.
TEST(Reload, AsksNothingOfThreadsThatHadEnded) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  const auto reloaded_at = [&](const char* time) {
    return Verified(ended("former", std::string(time) + " reload app spec=" + sha256),
                    kFifo80)["S1"];
  };
  EXPECT_EQ(reloaded_at("30"), Verdict::not_applicable);
  EXPECT_EQ(reloaded_at("15"), Verdict::fail) << "it lived on";
}

TEST(Reload, AsksNothingKnownOfThreadsThatHadEndedWhereTheirSpecIsNotTold) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  auto trace = trace_of(ended("former", "30 reload app spec=" + sha256));
  trace.erase<RunBegin>(
      [](const RunBegin& e, const EventHead&) { return e.spec_sha256 == "former"; });
  EXPECT_EQ(Verified(trace, kFifo80)["S1"], Verdict::inconclusive) << "it may have been this one";
}

// As where a file with announcements is missing, which no loss tells.
TEST(Reload, MayBeUnseenWhereAThreadWasNeverAnnounced) {
  const auto judged = [](const std::string& more) {
    auto trace = trace_of(ended("former", more));
    trace.erase<RunBegin>();
    return Verified(trace, kFifo80)["S1"];
  };
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_EQ(judged("thread other worker tid=150 silent\n5 audit other"), Verdict::inconclusive);
}

TEST(Reload, ToASpecOfBeforeAsksThreadsThatEndedWithItThen) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  const auto and_back = [&](const char* other_since) {
    return refused_and_ended(
        sha256, std::string(other_since) + " reload app spec=other\n40 reload app spec=" + sha256);
  };
  EXPECT_EQ(Verified(and_back("30"), kFifo80)["S1"], Verdict::fail);
  EXPECT_EQ(Verified(and_back("15"), kFifo80)["S1"], Verdict::inconclusive)
      << "the other one may have been refused";
  auto trace = trace_of(and_back("30"));
  trace.erase<RunBegin>([](const RunBegin&, const EventHead& head) { return head.time.ns < 20; });
  EXPECT_EQ(Verified(trace, kFifo80)["S1"], Verdict::inconclusive) << "its spec is not told";
}

TEST(Reload, OfOneExecutorTellsNotWhatAnothersThreadsHadToDo) {
  const std::string sha256 = SchedulingSpec::parse(kFifo80, "").sha256();
  const Verified verified(refused_and_ended("former", "30 reload app spec=" + sha256), kFifo80);
  EXPECT_EQ(verified["S1"], Verdict::inconclusive) << "a second executor may have had it";
  EXPECT_THAT(verified.evidence("S1", "callback fusion"),
              AllOf(HasSubstr("the request failed with EPERM"), HasSubstr("is unknown")));
}

TEST(Reload, MayBeLostBehindTheEndOfAThread) {
  const auto judged = [](const std::string& more) {
    return Verified(refused_and_ended("former", more), kFifo80)["S1"];
  };
  EXPECT_EQ(judged("30 discard user until=31 count=1"), Verdict::inconclusive);
  EXPECT_EQ(judged("9 discard user until=9 count=1"), Verdict::fail) << "no reload can be there";
}

// Writers other than this project's may list CPUs in any order.
TEST(ParametersAsSpecified, TakesCpusInAnyOrder) {
  auto trace = trace_of(
      "callback fusion\n1 initial fusion cpus=0,1\n2 applied fusion cpus=0,1\n"
      "10 start fusion cpu=1\n12 end fusion cpu=1");
  const std::vector<std::uint32_t> descending{1, 0};
  for (auto& event : trace.events) {
    if (auto* sched = std::get_if<ThreadSched>(&event.body)) sched->cpus = descending;
  }
  const Verified verified(trace, "callback_groups:\n  - {id: fusion, affinity: [0, 1]}\n");
  EXPECT_EQ(verified["S1"], Verdict::pass);
  EXPECT_EQ(verified["S4"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
