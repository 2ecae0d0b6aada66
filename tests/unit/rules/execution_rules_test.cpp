#include "support/verdicts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kSound = R"(
  callback fusion
  10 start fusion
  12 end fusion
  20 start fusion
  22 end fusion)";

void drop_end(TextTrace& trace, std::uint64_t seq) {
  ASSERT_EQ(trace.erase<CallbackEnd>(
                [seq](const CallbackEnd& e, const EventHead&) { return e.seq == seq; }),
            1U);
}

TEST(StartEndPaired, FailsWhenTheTotalsSayThatAnInstanceNeverEnded) {
  EXPECT_EQ(Verified(kSound)["E1"], Verdict::pass);
  const Verified verified(std::string(kSound) + "\n30 start fusion");
  EXPECT_EQ(verified.of("E1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("E1", "callback fusion"),
              AllOf(HasSubstr("30 callback_start seq 2 starts and never ends"),
                    HasSubstr("3 started, 2 ended, at a clean exit")));
}

TEST(StartEndPaired, PassesAndNamesWhatAnExceptionEnded) {
  const Verified verified(R"(
    callback fusion
    10 start fusion
    14 end fusion exception
    20 start fusion
    24 end fusion
    30 start fusion
    34 end fusion exception)");
  EXPECT_EQ(verified.of("E1", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.evidence("E1", "callback fusion"),
            "14 callback_end 2 instances ended by an exception, first seq 0\n");
  EXPECT_EQ(verified.result.report.callbacks.at(0).exceptions, 2U);
}

TEST(StartEndPaired, KnowsNoExceptionsWhereEndsDoNotTell) {
  auto trace = trace_of("callback fusion\n10 start fusion\n14 end fusion");
  EXPECT_EQ(Verified(trace).result.report.callbacks.at(0).exceptions, 0U);
  for (auto& event : trace.events) {
    if (auto* end = std::get_if<CallbackEnd>(&event.body)) end->status.reset();
  }
  EXPECT_EQ(Verified(trace).result.report.callbacks.at(0).exceptions, std::nullopt);
}

// The second instance of fusion starts on its thread and ends on lidar's.
constexpr const char* kEndsElsewhere = R"(
  callback fusion timer period=10 deadline=6
  callback lidar
  10 start fusion release=10
  12 end fusion
  20 start fusion release=20
  25 end fusion on=lidar
  30 start lidar
  34 end lidar
  40 start fusion release=40
  43 end fusion)";

TEST(StartEndPaired, PassesAndNamesWhatEndedOnAnotherThread) {
  const Verified verified(kEndsElsewhere);
  for (const auto* rule : {"T4", "E1", "E2", "E3", "R1", "R3"})
    EXPECT_EQ(verified[rule], Verdict::pass) << rule;
  const auto& report = verified.result.report;
  const auto tid = [&report](std::size_t callback) {
    return std::to_string(report.callbacks.at(callback).threads.at(0).tid);
  };
  EXPECT_EQ(verified.evidence("E1", "callback fusion"),
            "25 callback_end 1 instance ended on another thread than started it, first seq 1: "
            "thread " +
                tid(0) + ", then thread " + tid(1) + "\n");
  EXPECT_EQ(verified["M3"], Verdict::fail);
  EXPECT_THAT(verified.evidence("M2", "thread " + tid(1)),
              HasSubstr("25 callback_end fusion ended here (seq 1), which had started on thread " +
                        tid(0)));
  EXPECT_EQ(report.callbacks.at(0).instances, 3U);
  EXPECT_EQ(report.callbacks.at(0).response_time->max, 5);
  EXPECT_TRUE(report.defects.empty());
}

// Once its start is lost nobody knows where it was.
TEST(StartEndPaired, DoesNotGuessWhereAnEndOnAnotherThreadBegan) {
  auto trace = trace_of(kEndsElsewhere);
  trace.erase<CallbackStart>([](const CallbackStart& start, const EventHead& head) {
    return start.seq == 1 && head.time.ns == 20;
  });
  const Verified verified(trace);
  EXPECT_EQ(verified["E1"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("M2", "thread 102"), HasSubstr("its start was not seen"));
}

// A loss in between may have taken the end of a program and the beginning of another one with its pid,
// whose thread that is.
TEST(StartEndPaired, TakesNoEndBehindALossOnAThreadThatWasNotSeenBeforeForTheInstances) {
  const auto on = [](const char* thread, const char* lost) {
    return Verified(std::string(kEndsElsewhere) +
                    "\nthread other pool silent\n50 start fusion release=50\n" +
                    "56 end fusion on=" + thread + "\n" + lost);
  };
  const char* const lost = "52 discard user until=54 count=3";
  for (const auto* rule : {"E1", "R1"}) {
    EXPECT_EQ(on("other", "")[rule], Verdict::pass) << rule;
    EXPECT_EQ(on("other", lost)[rule], Verdict::inconclusive) << rule;
    EXPECT_EQ(on("lidar", lost)[rule], Verdict::pass) << rule << ": it was there before";
  }
  EXPECT_EQ(on("other", "").result.report.callbacks.at(0).instances, 4U);
  EXPECT_EQ(on("other", lost).result.report.callbacks.at(0).instances, 3U);
}

// fusion's instance may have left its thread before plan started there.
TEST(NoNesting, IsInconclusiveInsideAnInstanceThatEndsOnAnotherThread) {
  const Verified verified(R"(
    thread pool1 pool
    thread pool2 pool
    callback fusion pooled
    callback plan pooled
    10 start fusion on=pool1
    12 start plan on=pool1
    14 end plan on=pool1
    16 end fusion on=pool2)");
  EXPECT_EQ(verified["E3"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("E3", "thread 101"),
              HasSubstr("16 callback_end fusion ended on another thread: whether it had left this "
                        "one when plan started here is unknown"));
}

TEST(StartEndPaired, IsInconclusiveWhenAnEndWasLost) {
  auto trace = trace_of(kSound);
  drop_end(trace, 0);
  EXPECT_EQ(Verified(trace)["E1"], Verdict::inconclusive);
}

TEST(StartEndPaired, IsInconclusiveWhenAnEndWasLostBeforeACrash) {
  auto trace = trace_of("process app crash" + std::string(kSound));
  EXPECT_EQ(Verified(trace)["E1"], Verdict::pass);
  drop_end(trace, 0);
  EXPECT_EQ(Verified(trace)["E1"], Verdict::inconclusive)
      << "its thread went on, so the instance had ended";
}

// A crash may cut an instance, an end in order may not.
TEST(StartEndPaired, IsInconclusiveWhereARunEndWasLostAfterAnInstanceThatNeverEnded) {
  const auto without_run_end = [](const std::string& text) {
    auto trace = trace_of(text);
    trace.erase<RunEnd>();
    return Verified(trace)["E1"];
  };
  const auto open = std::string(kSound) + "\n30 start fusion\n40 fini fusion";
  ASSERT_EQ(Verified(open)["E1"], Verdict::fail);
  EXPECT_EQ(without_run_end(open), Verdict::pass);
  EXPECT_EQ(without_run_end(open + "\n41 discard user until=50 count=1"), Verdict::inconclusive);
  EXPECT_EQ(without_run_end(open + "\n1 discard user until=5 count=1"), Verdict::pass);
  EXPECT_EQ(without_run_end(std::string(kSound) + "\n41 discard user until=50 count=1"),
            Verdict::pass)
      << "all ended";
}

TEST(StartEndPaired, FailsForASecondEnd) {
  auto trace = trace_of(std::string(kSound) + "\n15 end fusion seq=0");
  for (auto& event : trace.events) {  // the executor's own count is right
    if (auto* fini = std::get_if<CallbackFini>(&event.body)) fini->ended = 2;
  }
  const Verified verified(trace);
  EXPECT_EQ(verified.of("E1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("E1", "callback fusion"),
              AllOf(HasSubstr("12 callback_end seq 0 ends"),
                    HasSubstr("15 callback_end seq 0 ends a second time")));
}

TEST(StartEndPaired, IsInconclusiveForASecondEndBehindALoss) {
  const auto judged = [](const char* lost) {
    return Verified("process app crash" + std::string(kSound) + "\n15 end fusion seq=0\n" +
                    lost)["E1"];
  };
  EXPECT_EQ(judged("13 discard user until=14 count=1"), Verdict::inconclusive);
  EXPECT_EQ(judged("30 discard user until=31 count=1"), Verdict::fail);
}

TEST(StartEndPaired, FailsForAnEndBeyondTheTotal) {
  const Verified verified(std::string(kSound) + "\n30 end fusion seq=7");
  EXPECT_EQ(verified.of("E1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("E1", "callback fusion"),
              AllOf(HasSubstr("30 callback_end ends seq 7"), HasSubstr("but only 2 started")));
}

TEST(StartEndPaired, JudgesNotWhatTheBeginCut) {
  EXPECT_EQ(Verified("process app attached\ncallback fusion next=3\n5 end fusion seq=2\n"
                     "10 start fusion\n12 end fusion")["E1"],
            Verdict::pass);
}

constexpr const char* kOverlap = R"(
  thread t1 pool
  thread t2 pool
  callback fusion pooled
  10 start fusion on=t1
  12 start fusion on=t2
  14 end fusion on=t1
  16 end fusion on=t2)";

TEST(NonReentrant, FailsWhenTwoInstancesOverlap) {
  EXPECT_EQ(Verified(kSound)["E2"], Verdict::pass);
  const Verified verified(kOverlap);
  EXPECT_EQ(verified.of("E2", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("E2", "callback fusion"),
              AllOf(HasSubstr("10 callback_start seq 0 starts"),
                    HasSubstr("12 callback_start seq 1 starts before seq 0 has ended"),
                    HasSubstr("14 callback_end seq 0 ends")));
}

// Streams are merged in some order where times are equal: which CPU comes first says nothing.
TEST(NonReentrant, InstancesThatTouchDoNotOverlap) {
  constexpr auto kTouching = R"(
    thread t1 pool
    thread t2 pool
    callback fusion pooled
    10 start fusion on=t1
    14 start fusion on=t2 seq=1 cpu=1
    14 end fusion on=t1 seq=0
    16 end fusion on=t2 seq=1)";
  EXPECT_EQ(Verified(kTouching)["E2"], Verdict::pass);
}

TEST(NonReentrant, FailsWhereBothStartsAndTheEndBehindThemWereSeen) {
  auto trace = trace_of(kOverlap);
  trace.erase<CallbackFini>();
  EXPECT_EQ(Verified(trace)["E2"], Verdict::fail) << "whatever else was lost";
}

TEST(NonReentrant, IsInconclusiveWhenAnEndMayBeLostInBetween) {
  auto trace = trace_of(kSound);
  drop_end(trace, 0);
  EXPECT_EQ(Verified(trace)["E2"], Verdict::inconclusive);
  trace = trace_of("process app crash" + std::string(kSound));
  drop_end(trace, 0);
  EXPECT_EQ(Verified(trace)["E2"], Verdict::inconclusive);
}

constexpr const char* kNested = R"(
  callback fusion
  callback plan pooled
  10 start fusion
  12 start plan on=fusion
  14 end plan on=fusion
  16 end fusion)";

TEST(NoNesting, InstancesThatTouchAreNotNested) {
  constexpr auto kTouching = R"(
    thread t1 pool
    callback fusion pooled
    callback plan pooled
    10 start fusion on=t1
    14 start plan on=t1 cpu=1
    14 end fusion on=t1
    16 end plan on=t1 cpu=1)";
  EXPECT_EQ(Verified(kTouching)["E3"], Verdict::pass);
}

TEST(NoNesting, FailsWhenACallbackStartsInsideAnother) {
  EXPECT_EQ(Verified(kSound)["E3"], Verdict::pass);
  const Verified verified(kNested);
  EXPECT_EQ(verified.of("E3", "thread 101"), Verdict::fail);
  EXPECT_THAT(verified.evidence("E3", "thread 101"),
              AllOf(HasSubstr("10 callback_start fusion starts"),
                    HasSubstr("12 callback_start plan starts inside it"),
                    HasSubstr("16 callback_end fusion ends")));
}

TEST(NoNesting, IsInconclusiveWhenAnEndMayBeLostInBetween) {
  auto trace = trace_of(kSound);
  drop_end(trace, 0);
  EXPECT_EQ(Verified(trace)["E3"], Verdict::inconclusive);
}

// exit() is called while it runs: its end follows the totals.
TEST(StartEndPaired, TakesAnEndAfterTheTotalsForOne) {
  const std::string run =
      "callback fusion\n10 start fusion\n12 end fusion\n20 start fusion\n25 fini fusion";
  EXPECT_EQ(Verified(run)["E1"], Verdict::fail) << "it never ends";
  EXPECT_EQ(Verified(run + "\n30 end fusion")["E1"], Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
