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

// Another process may have been between the two.
TEST(MappingSurvivesRestart, IsInconclusiveWhereALossMayHideALifetime) {
  const auto with_loss = [](const char* after, const char* loss) {
    return Verified(restarted("policy=fifo priority=50", after) + "\n" + loss).of("M5", kLater);
  };
  constexpr auto kSame = "policy=fifo priority=50";
  EXPECT_EQ(with_loss(kSame, "500 discard user until=600 count=4"), Verdict::inconclusive);
  EXPECT_EQ(with_loss(kSame, "500 discard user until=600 count=3"), Verdict::pass);
  EXPECT_EQ(with_loss(kSame, "1111 discard user until=1112 count=4"), Verdict::pass);
  EXPECT_EQ(with_loss("policy=other", "500 discard user until=600 count=4"), Verdict::fail)
      << "it was changed, if by another restart";
}

// Nothing is missing: no thread was ever made for it.
TEST(MappingSurvivesRestart, AsksForNoParametersOfWhatNeverHadAThread) {
  const Verified verified(
      "process first pid=100 until=100\n"
      "callback a id=/n@Timer timer period=10\n"
      "process second pid=200 from=1000\n"
      "callback b id=/n@Timer timer period=10 pooled\n"
      "callback other id=/n@Timer(20) timer period=20\n"
      "1 initial a\n2 applied a policy=fifo priority=50\n10 start a\n12 end a\n"
      "1110 start other\n1112 end other");
  EXPECT_EQ(verified.of("M5", kLater), Verdict::pass) << verified.evidence("M5", kLater);
}

// One that neither ran nor was read back tells nothing of how the callback returned.
TEST(MappingSurvivesRestart, ComparesWithTheLastLifetimeThatRan) {
  const auto judged = [](const std::string& after,
                         const std::string& of_third = "timer period=10") {
    const Verified verified(
        "process first pid=100 until=100\n"
        "callback a id=/n@Timer timer period=10\n"
        "process second pid=200 from=500 until=600\n"
        "callback b id=/n@Timer timer period=10 pooled\n"
        "process third pid=300 from=1000\n"
        "callback c id=/n@Timer " +
        of_third +
        "\n1 initial a\n2 applied a policy=fifo priority=50\n10 start a\n12 end a\n"
        "1101 initial c\n1102 applied c " +
        after + "\n1110 start c\n1112 end c");
    return verified.of("M5", "callback /n@Timer (pid 300)");
  };
  EXPECT_EQ(judged("policy=fifo priority=50"), Verdict::pass);
  EXPECT_EQ(judged("policy=other"), Verdict::fail);
  EXPECT_EQ(judged("policy=fifo priority=50", "timer period=20"), Verdict::fail);
}

TEST(MappingSurvivesRestart, IsInconclusiveWhenALaterReadBackWasLost) {
  auto trace = trace_of(
      restarted("policy=fifo priority=50", "policy=other\n1105 applied b policy=fifo priority=50"));
  trace.erase<ThreadSched>(
      [](const ThreadSched& e, const EventHead& head) { return e.n == 2 && head.pid == 200; });
  EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive) << "no false FAIL";
}

// Of neither lifetime is known what its thread was.
TEST(MappingSurvivesRestart, IsInconclusiveWhenTheThreadsOfBothWereLost) {
  auto trace = trace_of(restarted("policy=fifo priority=50", "policy=fifo priority=51"));
  ASSERT_EQ(Verified(trace).of("M5", kLater), Verdict::fail);
  trace.erase<ThreadInit>();
  trace.erase<ThreadSched>();
  trace.erase<ThreadFini>();
  EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive);
  trace.erase<CallbackStart>();
  trace.erase<CallbackEnd>();
  EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive);
  trace.erase<RunEnd>();
  EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::pass) << "nothing tells of a loss";
  const auto lossy = restarted("policy=fifo priority=50", "policy=fifo priority=51") +
                     "\n0 discard user until=5 count=4";
  auto interrupted = trace_of(lossy);
  interrupted.erase<ThreadInit>();
  interrupted.erase<ThreadSched>();
  interrupted.erase<ThreadFini>();
  interrupted.erase<RunEnd>();
  EXPECT_EQ(Verified(interrupted).of("M5", kLater), Verdict::inconclusive);
}

TEST(MappingSurvivesRestart, SaysWhereItComparesNoParameters) {
  const Verified verified(
      "process first pid=100 until=100\n"
      "thread p pool\n"
      "callback a id=/n@Timer timer period=10 pooled\n"
      "process second pid=200 from=1000\n"
      "thread q pool\n"
      "callback b id=/n@Timer timer period=10 pooled\n"
      "10 start a on=p\n12 end a on=p\n1110 start b on=q\n1112 end b on=q");
  EXPECT_EQ(verified.of("M5", kLater), Verdict::pass) << verified.evidence("M5", kLater);
  EXPECT_THAT(verified.evidence("M5", kLater), HasSubstr("nothing tells what its threads ran as"));
}

// One instance on a thread of each priority; each lifetime has a pool.
std::string pooled_twice(const std::vector<int>& before, const std::vector<int>& after) {
  std::string text;
  const auto add = [&text](const std::string& process, const std::string& callback,
                           const std::vector<int>& priorities, std::int64_t from) {
    std::string events;
    text += process;
    for (std::size_t i = 0; i < priorities.size(); ++i) {
      const auto thread = callback + std::to_string(i);
      const auto at = [from](std::size_t time) {
        return "\n" + std::to_string(from + static_cast<std::int64_t>(time));
      };
      text += "thread " + thread + " pool\n";
      events += at(1) + " initial " + thread + at(2) + " applied " + thread +
                " policy=fifo priority=" + std::to_string(priorities[i]) + at(10 + 4 * i) +
                " start " + callback + " on=" + thread + at(12 + 4 * i) + " end " + callback +
                " on=" + thread;
    }
    text += "callback " + callback + " id=/n@Timer timer period=10 pooled\n";
    return events;
  };
  const auto first = add("process first pid=100 until=100\n", "a", before, 0);
  const auto second = add("process second pid=200 from=1000\n", "b", after, 1100);
  return text + first + second;
}

// Which of a pool's threads runs a callback is chance, what all of them run as is not.
TEST(MappingSurvivesRestart, ComparesWhatAllThreadsOfAPoolRanAs) {
  const auto judged = [](const std::vector<int>& before, const std::vector<int>& after) {
    return Verified(pooled_twice(before, after)).of("M5", kLater);
  };
  EXPECT_EQ(judged({40}, {40}), Verdict::pass);
  EXPECT_EQ(judged({40}, {40, 40}), Verdict::pass);
  EXPECT_EQ(judged({40, 41}, {41, 40}), Verdict::pass);
  EXPECT_EQ(judged({40}, {41}), Verdict::fail);
  EXPECT_EQ(judged({40, 40}, {41, 42}), Verdict::fail);
  EXPECT_EQ(judged({40}, {40, 41}), Verdict::inconclusive);
  EXPECT_EQ(judged({40, 42}, {40, 41}), Verdict::inconclusive);
  EXPECT_THAT(Verified(pooled_twice({40}, {41})).evidence("M5", kLater),
              AllOf(HasSubstr("2 thread_sched was: SCHED_FIFO 40"),
                    HasSubstr("1102 thread_sched is: SCHED_FIFO 41")));
}

TEST(MappingSurvivesRestart, ComparesNothingOfAPoolWhereSomethingIsLost) {
  for (const std::int64_t lost : {2, 14, 1102, 1110}) {
    auto trace = trace_of(pooled_twice({40, 41}, {42}));
    ASSERT_EQ(Verified(trace).of("M5", kLater), Verdict::fail);
    const auto is_lost = [lost](const auto&, const EventHead& head) {
      return head.time.ns == lost || (head.time.ns == lost + 2 && lost % 100 >= 10);
    };
    trace.erase<ThreadSched>(is_lost);
    trace.erase<CallbackStart>(is_lost);
    trace.erase<CallbackEnd>(is_lost);
    EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive) << lost;
  }
}

TEST(MappingSurvivesRestart, ComparesAPoolWithAThreadOfItsOwn) {
  const auto judged = [](const std::string& pooled) {
    return Verified(
               "process first pid=100 until=100\n"
               "callback a id=/n@Timer timer period=10\n"
               "process second pid=200 from=1000\n"
               "thread q pool\n"
               "callback b id=/n@Timer timer period=10 pooled\n"
               "1 initial a\n2 applied a policy=fifo priority=40\n10 start a\n12 end a\n"
               "1101 initial q\n1102 applied q policy=fifo priority=" +
               pooled + "\n1110 start b on=q\n1112 end b on=q")
        .of("M5", kLater);
  };
  EXPECT_EQ(judged("40"), Verdict::pass);
  EXPECT_EQ(judged("41"), Verdict::fail);
}

// Two processes at once, and then a third one: which of them it follows is known if they agree, or if it is like neither.
TEST(MappingSurvivesRestart, ComparesWithAllThatItMayFollow) {
  const auto judged = [](int first, int second, int third) {
    const auto priority = [](int value) {
      return " policy=fifo priority=" + std::to_string(value);
    };
    return Verified(
               "process one pid=100 until=100\ncallback a id=/n@Timer timer period=10\n"
               "process two pid=150 until=100\ncallback b id=/n@Timer timer period=10\n"
               "process three pid=200 from=1000\ncallback c id=/n@Timer timer period=10\n"
               "1 initial a\n2 applied a" +
               priority(first) +
               "\n10 start a\n12 end a\n"
               "1 initial b\n2 applied b" +
               priority(second) +
               "\n10 start b\n12 end b\n"
               "1101 initial c\n1102 applied c" +
               priority(third) + "\n1110 start c\n1112 end c")
        .of("M5", kLater);
  };
  EXPECT_EQ(judged(20, 20, 20), Verdict::pass);
  EXPECT_EQ(judged(20, 20, 30), Verdict::fail);
  EXPECT_EQ(judged(20, 25, 30), Verdict::fail);
  EXPECT_EQ(judged(20, 30, 30), Verdict::inconclusive);
  EXPECT_EQ(judged(30, 20, 30), Verdict::inconclusive);
}

// The second of three: each is compared with the one before it, which may have been that one.
TEST(MappingSurvivesRestart, IsInconclusiveAfterALifetimeOfWhichNoIdWasSeen) {
  const auto judged = [](const std::string& third) {
    auto trace = trace_of(
        "process one pid=100 until=100\ncallback a id=/n@Timer timer period=10\n"
        "process two pid=150 from=1000 until=1200\ncallback b id=/n@Timer timer period=10\n"
        "process three pid=200 from=2000\ncallback c id=/n@Timer timer period=10\n"
        "1 initial a\n2 applied a policy=fifo priority=20\n10 start a\n12 end a\n"
        "1101 initial b\n1102 applied b policy=fifo priority=30\n1110 start b\n1112 end b\n"
        "2101 initial c\n2102 applied c policy=fifo priority=" +
        third + "\n2110 start c\n2112 end c");
    const auto whole = Verified(trace).of("M5", kLater);
    trace.erase<CallbackInit>(
        [](const CallbackInit&, const EventHead& head) { return head.pid == 150; });
    EXPECT_EQ(Verified(trace).of("M5", kLater), Verdict::inconclusive);
    return whole;
  };
  EXPECT_EQ(judged("30"), Verdict::pass) << "as the second";
  EXPECT_EQ(judged("20"), Verdict::fail) << "as the first";
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

// Two processes of which the second announces itself when the first has ended, because the
// recording began meanwhile. It is older, or began by then, as far as the kernel's ticks tell.
struct Announced {
  explicit Announced(std::int64_t start) : trace(trace_of(kText)) {
    for (auto& event : trace.events) {
      auto* begin = std::get_if<RunBegin>(&event.body);
      if (begin != nullptr && event.head.pid == 200) begin->process_start_ns = start;
    }
  }

  static constexpr const char* kText = R"(
    process first pid=100 until=100
    callback a id=/n@Timer timer period=10
    process second pid=200 from=50000000 attached
    callback b id=/n@Timer timer period=10
    1 initial a
    2 applied a policy=fifo priority=30
    10 start a
    12 end a
    50000101 initial b
    50000102 applied b policy=fifo priority=31)";
  static constexpr std::int64_t kOlder = -60'000'000;
  static constexpr std::int64_t kLater = 45'000'000;
  TextTrace trace;
};

TEST(MappingSurvivesRestart, IsNotOfProcessesThatLivedAtTheSameTime) {
  EXPECT_EQ(Verified(Announced(Announced::kOlder).trace)["M5"], Verdict::not_applicable);
  EXPECT_EQ(Verified(Announced(Announced::kLater).trace).of("M5", kLater), Verdict::fail);
}

// It may be the older one.
TEST(MappingSurvivesRestart, IsInconclusiveWhereTheAnnouncementOfALaterProcessIsLost) {
  const auto judged = [](const std::string& more) {
    auto trace = trace_of(Announced::kText + more);
    trace.erase<RunBegin>([](const RunBegin&, const EventHead& head) {
      return head.pid == 200 && head.time.ns < 50'000'100;
    });
    return Verified(trace).of("M5", kLater);
  };
  const std::string loss = "\n49999990 discard user until=50000000 count=1";
  EXPECT_EQ(judged(loss), Verdict::inconclusive);
  EXPECT_EQ(judged(loss + "\n50000150 reload second spec=other"), Verdict::inconclusive);
}

// Two lifetimes within a process that was attached to. What its main thread announced may be older than that.
TEST(MappingSurvivesRestart, ComparesWhatAnAttachedProcessMakesAnew) {
  const auto judged = [](const std::string& init, const std::string& more = "") {
    auto trace = trace_of(
        "process p pid=200 from=1000 attached\n"
        "thread app worker\n"
        "callback a id=/n@Timer timer period=10\n"
        "callback b id=/n@Timer timer period=20\n"
        "1101 start a\n1102 end a\n1110 finish a\n1111 fini a\n1120 init b" +
        init + "\n1121 begin b\n1122 initial b\n1123 applied b\n1130 start b\n1131 end b" + more);
    trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
      return e.period_ns == 20 && head.time.ns < 1101;
    });
    return Verified(trace)["M5"];
  };
  EXPECT_EQ(judged(" on=app"), Verdict::fail) << "its period is another one";
  EXPECT_EQ(judged(""), Verdict::inconclusive)
      << "an announcement told it, whose callback_init may have been lost before";
  EXPECT_EQ(judged(" on=app", "\n1115 discard user until=1116 count=1"), Verdict::inconclusive)
      << "as the run_begin of one that app made";
}

// Two lifetimes within a process whose spec was reloaded between them, by the thread that makes
// both. The announcement ends with the threads: what is told behind them is no part of it.
TEST(MappingSurvivesRestart, ComparesWhatTheThreadThatReloadedTheSpecMakesLater) {
  const auto judged = [](const std::string& announced, const std::string& more = "") {
    auto trace = trace_of(
        "process p pid=200\n"
        "thread main worker tid=200\n"
        "callback a id=/n@Timer timer period=10\n"
        "callback b id=/n@Timer timer period=20\n"
        "1 start a\n2 end a\n10 finish a\n11 fini a\n15 reload\n" +
        announced + "\n20 init b\n21 begin b\n22 initial b\n23 applied b\n30 start b\n31 end b\n" +
        more);
    trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
      return e.period_ns == 20 && head.time.ns < 1;
    });
    return Verified(trace)["M5"];
  };
  EXPECT_EQ(judged("16 repeat main on=main"), Verdict::fail) << "its period is another one";
  EXPECT_EQ(judged(""), Verdict::inconclusive)
      << "it may be repeated there, and its first callback_init lost before";
  EXPECT_EQ(judged("16 repeat main on=b"), Verdict::inconclusive) << "another thread told that";
  EXPECT_EQ(judged("16 repeat main on=main\n18 reload"), Verdict::inconclusive) << "once more";
  EXPECT_EQ(judged("16 repeat main on=main", "17 discard user until=18 count=1"),
            Verdict::inconclusive)
      << "as another announcement's run_begin";
}

// The first one idles, or was killed: neither tells.
TextTrace perhaps_idle(int second_priority, const std::string& lines) {
  return trace_of(
      "process first pid=100 until=500 crash\ncallback a id=/n@Timer timer period=10\n"
      "thread main worker tid=100 silent\n"
      "process second pid=200 from=200\ncallback b id=/n@Timer timer period=10\n"
      "kernel\n1 initial a\n2 applied a policy=fifo priority=30\n"
      "10 start a\n12 end a\n301 initial b\n302 applied b policy=fifo priority=" +
      std::to_string(second_priority) + "\n310 start b\n312 end b\n" + lines);
}

TEST(MappingSurvivesRestart, FailsOnlyWhereTheFormerLifetimeIsSeenToEnd) {
  const auto judged = [](int second_priority, const std::string& lines) {
    return Verified(perhaps_idle(second_priority, lines));
  };
  EXPECT_EQ(judged(31, "").of("M5", kLater), Verdict::inconclusive);
  EXPECT_EQ(judged(30, "").of("M5", kLater), Verdict::pass) << "like it, ended or not";
  EXPECT_EQ(judged(31, "100 exit main").of("M5", kLater), Verdict::fail);
  EXPECT_EQ(judged(31, "100 exit a").of("M5", kLater), Verdict::inconclusive)
      << "its main thread lives on";
}

// A process that lives tells of its clocks every second.
TEST(MappingSurvivesRestart, FailsWhereTheFormerProcessIsSilentWhileTheOtherGoesOn) {
  const auto goes_on = [](const std::string& until, const std::string& lines = {}) {
    return Verified(perhaps_idle(31, until + " start b\n" + until + "0 end b\n" + lines));
  };
  EXPECT_EQ(goes_on("300000000").of("M5", kLater), Verdict::fail);
  EXPECT_EQ(goes_on("100000000").of("M5", kLater), Verdict::inconclusive);
  EXPECT_EQ(goes_on("300000000", "1000000000 discard user until=1000000010 count=1")["M5"],
            Verdict::inconclusive);
}

// A pid that another process has is nobody's any more.
TEST(MappingSurvivesRestart, FailsWhereThePidWasGivenAnew) {
  auto trace = perhaps_idle(31, "");
  for (auto& event : trace.events) {
    if (event.head.pid == 200) event.head.pid = 100;
    auto* begin = std::get_if<RunBegin>(&event.body);
    if (begin != nullptr) begin->pid = 100;
  }
  EXPECT_EQ(Verified(trace)["M5"], Verdict::fail);
}

// The kernel alone sees it, after the second one has begun.
TEST(MappingSurvivesRestart, IsNotOfAProcessThatTheKernelSawAliveLater) {
  const auto trace =
      perhaps_idle(31, "400 switch 0 idle a next_prio=69\n401 switch 0 a idle state=1");
  EXPECT_EQ(Verified(trace)["M5"], Verdict::not_applicable);
}

TEST(SpecifiedCallbackSeen, AsksProcessesThatLivedAtTheSameTimeEach) {
  constexpr const char* kSpec = "callback_groups:\n  - id: /n@Timer\n";
  EXPECT_EQ(Verified(Announced(Announced::kOlder).trace, kSpec).of("M1", kLater), Verdict::fail);
  EXPECT_NE(Verified(Announced(Announced::kLater).trace, kSpec)["M1"], Verdict::fail)
      << "a restart, of which one has run";
}

}  // namespace
}  // namespace cie::test
