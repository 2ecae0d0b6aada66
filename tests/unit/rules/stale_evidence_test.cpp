// What was seen may be of something that was not: a wake-up of an instance that was lost, a wait that
// was not the first one, a thread that took another one's number.
#include "support/verdicts.hpp"

#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

template <typename Body>
void erase_at(TextTrace& trace, std::int64_t time) {
  trace.erase<Body>([time](const Body&, const EventHead& head) { return head.time.ns == time; });
}

// Wakes up for an instance; the next two take what arrived meanwhile.
constexpr const char* kBusy = R"(
  callback plan subscription topic=/x deadline=20
  100 wakeup plan
  101 start plan release=none
  105 end plan
  140 start plan release=none
  145 end plan
  150 start plan release=none
  152 end plan)";

TEST(AWakeUp, IsOfNoInstanceAfterOneThatWasLost) {
  ASSERT_NE(Verified(kBusy)["R3"], Verdict::fail);
  for (const std::string_view loss : {"", "\n100 discard user until=110 count=2"}) {
    auto trace = trace_of(kBusy + std::string(loss));
    erase_at<CallbackStart>(trace, 101);
    erase_at<CallbackEnd>(trace, 105);
    EXPECT_EQ(Verified(trace)["R3"], Verdict::inconclusive) << loss;
  }
}

TEST(AWakeUp, IsOfNoInstanceAfterOneWhoseEndWasLost) {
  auto trace = trace_of(kBusy + std::string("\n104 discard user until=106 count=1"));
  erase_at<CallbackEnd>(trace, 105);
  EXPECT_EQ(Verified(trace)["R3"], Verdict::inconclusive);
}

TEST(AWakeUp, BeforeAWindowIsOfTheInstanceThatEndedBeforeIt) {
  AnalysisOptions options;
  options.window = TimeWindow{.from = Timestamp{130}, .to = Timestamp{200}};
  EXPECT_EQ(Verified(trace_of(kBusy), {}, options)["R3"], Verdict::inconclusive);
}

TEST(AWakeUp, ThatFoundNothingToDoIsNoRelease) {
  const auto with = [](const std::string& reason) {
    return Verified(R"(
      callback plan subscription topic=/x deadline=20
      100 wakeup plan)" +
                    reason + R"(
      135 release plan
      140 start plan release=none
      145 end plan)")["R3"];
  };
  EXPECT_EQ(with(""), Verdict::fail);
  EXPECT_EQ(with(" spurious"), Verdict::inconclusive);
}

constexpr const char* kBudget = "callback_groups:\n  - {id: plan, foreign_work_budget: 30000000}\n";

// The thread waits at 5 for the first time, and then works 39 of 995 outside callbacks.
TEST(AForeignWorkBudget, IsNotJudgedWhereTheFirstWaitMayBeHidden) {
  const std::string rest = R"(
    callback plan timer
    kernel
    100 waking plan
    101 switch 0 idle plan
    102 start plan release=100
    104 end plan
    106 switch 0 plan idle state=1
    1000 waking plan
    1001 switch 0 idle plan)";
  const std::string begin = R"(
    -20 switch 0 idle plan
    5 switch 0 plan idle state=1
    20 waking plan
    21 switch 0 idle plan
    60 switch 0 plan idle state=1)";
  ASSERT_EQ(Verified(begin + rest, kBudget)["M6"], Verdict::fail);
  EXPECT_EQ(Verified("\n -20 switch 0 idle plan" + rest + "\n4 discard kernel until=61 count=4",
                     kBudget)["M6"],
            Verdict::inconclusive);
}

TEST(AForeignWorkBudget, IsNotJudgedWhereNobodyKnowsWhoseThreadItIs) {
  const std::string trace = R"(
    callback plan timer
    thread recv worker cpu=1
    kernel
    -100 initial recv
    -90 applied recv
    1 start plan release=1
    2 end plan
    10 switch 1 recv idle state=1
    20 waking recv
    21 switch 1 idle recv
    90 switch 1 recv idle state=1
    900 start plan release=11
    901 end plan)";
  constexpr const char* kOfWorker =
      "callback_groups:\n  - {id: plan}\n"
      "non_ros_threads:\n  - {id: recv, foreign_work_budget: 10000000}\n";
  ASSERT_EQ(Verified(trace, kOfWorker)["M6"], Verdict::fail);
  auto lossy = trace_of(trace + "\n-9990 discard user until=-9000 count=1");
  lossy.erase<ThreadInit>([](const ThreadInit& e, const EventHead&) { return e.name == "recv"; });
  EXPECT_EQ(Verified(lossy, kOfWorker)["M6"], Verdict::inconclusive);
}

// The threads of two callbacks have the same number, one after the other, and a run of the second one
// stands before what is left of its announcement, or nothing is left of that.
TEST(AThread, MayBeTwoOfTheSameNumberWhereTheEndOfOneIsLost) {
  const std::string trace = R"(
    callback plan timer period=100
    callback next timer period=100
    thread later callback of=next tid=101
    -9900 begin plan
    100 start plan release=100
    110 end plan
    150 finish plan
    160 begin later
    161 initial later n=0
    162 applied later n=1
    200 start next release=200 on=later
    210 end next on=later
    300 start next release=300 on=later
    310 end next on=later)";
  for (const auto* rule : {"M2", "M6"}) {
    const auto judged = [&](const TextTrace& events) {
      return Verified(events).of(rule, "thread 101");
    };
    EXPECT_EQ(judged(trace_of(trace)), Verdict::pass) << rule;
    auto lossy = trace_of(trace);
    erase_at<ThreadFini>(lossy, 150);
    erase_at<ThreadInit>(lossy, 160);
    EXPECT_EQ(judged(lossy), Verdict::inconclusive) << rule;
    auto by_turns =
        trace_of(trace + "\n250 start plan release=250 on=later\n260 end plan on=later");
    erase_at<ThreadFini>(by_turns, 150);
    erase_at<ThreadInit>(by_turns, 160);
    EXPECT_EQ(judged(by_turns), Verdict::fail) << rule << ": whoever began, one ran both";
  }
}

// Its callback went on on another thread of the same number, of which nothing else is left.
TEST(AThread, ThatTookAnothersNumberMayHaveBeenLost) {
  const std::string trace = R"(
    callback plan timer period=100
    thread again callback of=plan tid=101
    -9900 begin plan
    -60 initial plan n=0
    -50 applied plan n=1
    100 start plan release=100
    110 end plan
    150 finish plan
    160 begin again
    161 initial again n=0
    162 applied again n=1
    200 start plan release=200 on=again
    210 end plan on=again
    300 start plan release=300 on=again
    310 end plan on=again)";
  ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
  auto lossy = trace_of(trace + "\n149 discard user until=215 count=6");
  erase_at<ThreadFini>(lossy, 150);
  erase_at<ThreadInit>(lossy, 160);
  erase_at<ThreadSched>(lossy, 161);
  erase_at<ThreadSched>(lossy, 162);
  erase_at<CallbackStart>(lossy, 200);
  erase_at<CallbackEnd>(lossy, 210);
  EXPECT_EQ(Verified(lossy)["M4"], Verdict::inconclusive);
}

// Of the later one's ids, which are those of the first, the callbacks are others: its run_begin is gone.
TEST(AProcess, MayBeAnotherOfTheSamePid) {
  const auto without_begin = [](const std::string& text, std::int64_t begin) {
    auto trace = trace_of(text + "\n" + std::to_string(begin - 1) +
                          " discard user until=" + std::to_string(begin) + " count=1");
    erase_at<RunBegin>(trace, begin);
    return trace;
  };
  const std::string restarted = R"(
    process one pid=100 until=500
    callback plan timer period=100 deadline=20
    100 start plan release=100
    110 end plan
    200 start plan release=200
    210 end plan
    process two pid=100 from=2000
    callback slow timer period=1000
    3000 start slow release=3000
    3090 end slow
    4000 start slow release=4000
    4090 end slow)";
  ASSERT_EQ(Verified(restarted)["R3"], Verdict::pass);
  const Verified merged(without_begin(restarted, 2000));
  EXPECT_EQ(merged["R3"], Verdict::inconclusive);
  const auto& subject = merged.rule("R3").subjects.at(0).subject;
  EXPECT_THAT(merged.evidence("R3", subject), testing::HasSubstr("its run_begin was not recorded"));
  const std::string containers = R"(
    process one pid=100
    callback plan timer period=100
    100 start plan release=100
    110 end plan
    200 start plan release=200
    210 end plan
    process two pid=100 from=150
    callback drive timer period=100
    thread x pool
    220 start drive release=220
    230 end drive)";
  EXPECT_EQ(Verified(without_begin(containers, 150))["M3"], Verdict::inconclusive);
}

// It spins twice: in between somebody took its priority back, which is none of the executor's faults.
TEST(AThread, ThatSpinsAgainHasWhatItIsGivenThen) {
  const auto verdict = [](const std::string& between) {
    return Verified(R"(
      thread t pool
      callback one pooled
      kernel
      -70 begin t
      -60 initial t n=0
      -50 applied t n=1 policy=fifo priority=50
      10 start one on=t
      12 end one on=t
      20 audit t n=2 policy=fifo priority=50)" +
                    between + R"(
      42 switch 0 t idle state=1 prio=120
      44 switch 0 idle t next_prio=120
      45 applied t n=1 policy=fifo priority=50
      46 switch 0 t idle state=1 prio=49
      48 switch 0 idle t next_prio=49
      50 start one on=t
      52 end one on=t
      55 audit t n=2 policy=fifo priority=50
      60 finish t)")["S3"];
  };
  EXPECT_EQ(verdict("\n 30 finish t\n 40 begin t again\n 41 initial t n=0"), Verdict::pass);
  EXPECT_EQ(verdict(""), Verdict::fail);
}

// The thread that spins is announced for each spin, which the totals count.
TEST(AThread, ThatSpinsAgainIsOneThreadAndTwoAnnouncements) {
  const auto spun_twice = trace_of(R"(
    process app executor=single_threaded
    thread t dispatcher
    callback one pooled
    -70 begin t
    -60 initial t n=0
    -50 applied t n=1
    10 start one on=t
    12 end one on=t
    30 finish t
    40 begin t again
    41 initial t n=0
    42 applied t n=1
    50 start one on=t
    52 end one on=t
    60 finish t)");
  const auto threads = analyze(spun_twice).report.threads;
  EXPECT_EQ(std::ranges::count(threads, "t", &ThreadReport::name), 1);
  for (const auto* rule : {"T4", "M3", "M4", "M9"})
    EXPECT_EQ(Verified(spun_twice)[rule], Verdict::pass) << rule;
  auto lossy = spun_twice;
  erase_at<ThreadInit>(lossy, 40);
  EXPECT_EQ(Verified(lossy)["T4"], Verdict::inconclusive);
  lossy = spun_twice;
  erase_at<ThreadInit>(lossy, -70);
  EXPECT_EQ(Verified(lossy)["T4"], Verdict::inconclusive);
}

// What is applied first may send it to another CPU before it is read back: in each spin.
TEST(AThread, ThatSpinsAgainMayBeSentElsewhereBeforeItIsReadBack) {
  const auto applied = [](const std::string& cpus) {
    return Verified(R"(
      thread t pool cpu=1
      callback one pooled
      -70 begin t
      -60 initial t n=0 cpus=0,1
      -50 applied t n=1 cpus=1
      10 start one on=t
      12 end one on=t
      30 finish t
      40 begin t again
      41 initial t n=0 cpus=0
      42 start one on=t
      43 end one on=t
      45 applied t n=1 cpus=)" +
                    cpus + "\n60 finish t");
  };
  EXPECT_EQ(applied("1")["S4"], Verdict::pass);
  EXPECT_EQ(applied("0")["S4"], Verdict::fail);
  EXPECT_THAT(applied("0").evidence("S4", "thread 101"), testing::HasSubstr("41 thread_sched"));
}

// What it read back last tells where it may run while it spins: behind thread_fini nobody reads it back.
TEST(AThread, ThatSpinsNoMoreMayRunAnywhere) {
  const std::string spun = R"(
    callback plan
    publisher path
    -60 initial plan n=0 cpus=0,1
    -50 applied plan n=1 cpus=0
    10 start plan
    12 end plan
    )";
  const auto publishes = "\n20 publish path on=plan cpu=1";
  EXPECT_EQ(Verified(spun + "25 finish plan" + publishes)["S4"], Verdict::fail);
  auto ended = trace_of(spun + "15 finish plan" + publishes);
  EXPECT_EQ(Verified(ended)["S4"], Verdict::pass);
  ended.erase<ThreadFini>();
  EXPECT_EQ(Verified(ended)["S4"], Verdict::inconclusive) << "L2: it may have ended";
}

}  // namespace
}  // namespace cie::test
