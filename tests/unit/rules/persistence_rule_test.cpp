#include "replaced_thread.hpp"
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

TEST(MappingPersistent, FailsWhenAThreadWasReplaced) {
  const Verified verified(kReplaced);
  EXPECT_EQ(verified.of("M3", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("14 thread_fini"), HasSubstr("20 thread_init"),
                    HasSubstr("30 callback_start")));
}

TEST(MappingPersistent, FailsHoweverOftenThreadsThatLiveTogetherTookTurnsBefore) {
  std::string trace = R"(
    process app executor=multi_threaded
    callback fusion pooled
    thread t1 pool tid=101
    thread t2 pool tid=102
    thread t3 pool tid=103
    -500 begin t1
    -500 begin t2)";
  constexpr int kTurns = 2'000;
  for (int i = 0; i < kTurns; ++i) {
    const auto start = std::to_string(10 * i + 10);
    const auto end = std::to_string(10 * i + 12);
    const auto* thread = i % 2 == 0 ? "t1" : "t2";
    trace += "\n" + start + " start fusion on=" + thread + "\n" + end + " end fusion on=" + thread;
  }
  trace += R"(
    30000 finish t1
    30001 finish t2
    30002 begin t3
    30010 start fusion on=t3
    30012 end fusion on=t3
    30014 finish t3)";
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("30001 thread_fini"), HasSubstr("30002 thread_init"),
                    HasSubstr("30010 callback_start")));
}

TEST(MappingPersistent, AcceptsAMoveAfterANewRegistration) {
  const Verified verified(std::string(kReplaced) + "\n  16 init fusion");
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::pass);
}

// Of several moves one is a witness by itself, whatever was lost at the others.
TEST(MappingPersistent, FailsByAMoveThatIsCertainBesideOneBehindALoss) {
  const auto moved_twice = [](const std::string& loss) {
    return Verified(R"(
      callback fusion pooled
      thread one callback of=fusion tid=101
      10 start fusion on=one
      12 end fusion on=one
      14 finish one
      thread two callback of=fusion tid=102
      20 begin two
      30 start fusion on=two
      32 end fusion on=two
      34 finish two
      thread three callback of=fusion tid=103
      40 begin three
      50 start fusion on=three
      52 end fusion on=three)" +
                    loss);
  };
  ASSERT_EQ(moved_twice("")["M4"], Verdict::fail);
  const auto certain = moved_twice("\n16 discard user until=18 count=1");
  EXPECT_EQ(certain["M4"], Verdict::fail);
  EXPECT_THAT(certain.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("34 thread_fini"), HasSubstr("40 thread_init"),
                    HasSubstr("50 callback_start"), Not(HasSubstr("14 thread_fini"))));
  EXPECT_EQ(
      moved_twice("\n16 discard user until=18 count=1\n36 discard user until=38 count=1")["M4"],
      Verdict::inconclusive);
}

// State follows a repeated run_begin: where its callback_init is lost, the next one is taken for it.
TEST(MappingPersistent, IsInconclusiveWhereARegistrationMayBeTakenForARepetition) {
  const auto announced = std::string(kReplaced) + "\n  1 reload\n  16 init fusion";
  EXPECT_EQ(Verified(announced)["M4"], Verdict::fail);
  EXPECT_EQ(Verified(announced + "\n  2 init fusion")["M4"], Verdict::pass);
  EXPECT_EQ(Verified(announced + "\n  2 discard user until=4 count=1")["M4"],
            Verdict::inconclusive);
}

// As where a file of its registrations is missing, which no loss tells.
TEST(MappingPersistent, IsInconclusiveWhereNoRegistrationWasSeenBeforeTheMove) {
  auto trace = trace_of(std::string(kReplaced) + "\n40 init fusion");
  ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
  trace.erase<CallbackInit>(
      [](const CallbackInit&, const EventHead& head) { return head.time.ns < 0; });
  const Verified registered_later(trace);
  EXPECT_EQ(registered_later["M4"], Verdict::inconclusive);
  EXPECT_THAT(registered_later.evidence("M4", "callback fusion"),
              HasSubstr("its callback_init was not seen"));
  trace.erase<CallbackInit>();
  EXPECT_EQ(Verified(trace)["M4"], Verdict::inconclusive) << "nor at all";
}

// The file that had another thread's announcement may have had a registration, too.
TEST(MappingPersistent, IsInconclusiveWhereAThreadWasNeverAnnounced) {
  const Verified verified(std::string(kReplaced) +
                          "\nthread other worker tid=150 silent\n5 audit other");
  EXPECT_EQ(verified["M4"], Verdict::inconclusive);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              HasSubstr("thread 150 was never seen to be announced: other announcements"));
  const Verified ran(std::string(kReplaced) +
                     "\nthread other callback of=fusion tid=150 silent\n"
                     "-50 start fusion on=other\n-40 end fusion on=other\n-39 finish other");
  EXPECT_EQ(ran["M4"], Verdict::inconclusive) << ran.evidence("M4", "callback fusion");
}

// Its own announcement shows that some are missing, wherever nothing counts them any more.
TEST(MappingPersistent, IsInconclusiveWhereTheThreadItLeftWasNeverAnnounced) {
  auto trace = trace_of(std::string(kReplaced) + "\n15 exit t1");
  ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
  const auto is_of_first = [](const auto& event, const EventHead&) { return event.tid == 101; };
  ASSERT_EQ(trace.erase<ThreadInit>(is_of_first), 1U);
  ASSERT_EQ(trace.erase<ThreadFini>(is_of_first), 1U);
  trace.erase<ThreadSched>(is_of_first);
  const Verified counted(trace);
  EXPECT_EQ(counted["M4"], Verdict::inconclusive);
  EXPECT_THAT(counted.evidence("M4", "callback fusion"), HasSubstr("2 counted, 1 seen"));
  auto crashed = trace;
  ASSERT_EQ(crashed.erase<RunEnd>(), 1U);
  EXPECT_EQ(Verified(crashed)["M4"], Verdict::inconclusive);
  EXPECT_THAT(Verified(crashed).evidence("M4", "callback fusion"),
              HasSubstr("it ran on thread 101, whose announcement was not seen"));
  ASSERT_EQ(trace.erase<RunBegin>(), 1U);
  EXPECT_EQ(Verified(trace)["M4"], Verdict::inconclusive) << "run_end counts what nobody recorded";
}

// Totals prove that nobody's announcement is missing: threads that were never announced are strays.
TEST(MappingPersistent, FailsHoweverManyStrayThreadsItMovedTo) {
  auto trace = trace_of(R"(
    callback fusion pooled
    thread own callback of=fusion tid=101
    thread first worker tid=102 silent
    thread second worker tid=103 silent
    10 start fusion on=own
    12 end fusion on=own
    14 finish own
    20 start fusion on=first
    22 end fusion on=first
    30 start fusion on=second
    32 end fusion on=second)");
  trace.erase<ThreadFini>([](const ThreadFini& fini, const EventHead&) { return fini.tid != 101; });
  for (auto& event : trace.events)
    if (auto* end = std::get_if<RunEnd>(&event.body)) end->threads = 1;
  EXPECT_EQ(Verified(trace)["M4"], Verdict::fail);
}

// All that tells of the first thread is lost, and of the callback what came before the second one.
TextTrace without_first_thread(const std::string& lines, bool is_registered) {
  auto trace = trace_of("process app crash\n" + std::string(kReplaced) + lines);
  std::erase_if(trace.events, [is_registered](const Event& event) {
    const auto* init = std::get_if<CallbackInit>(&event.body);
    const auto* thread = std::get_if<ThreadInit>(&event.body);
    const bool is_of_first = event.head.tid == 101 || (thread != nullptr && thread->tid == 101);
    return is_of_first || (init != nullptr && !is_registered);
  });
  return trace;
}

// Numbers tell that it ran before, and the thread that it ran on may be among what was lost.
TEST(MappingPersistent, IsInconclusiveWhereItsFirstThreadMayBeLost) {
  const auto crashed = "process app crash\n" + std::string(kReplaced);
  ASSERT_EQ(Verified(crashed)["M4"], Verdict::fail);
  constexpr auto kLoss = "\n5 discard user until=14 count=6";
  for (const bool is_registered : {false, true}) {
    const Verified lossy(without_first_thread(kLoss, is_registered));
    EXPECT_EQ(lossy["M4"], Verdict::inconclusive) << is_registered;
    EXPECT_EQ(
        Verified(without_first_thread("\n31 discard user until=32 count=6", is_registered))["M4"],
        Verdict::pass)
        << "lost since its first instance that was seen";
    EXPECT_EQ(
        Verified(without_first_thread("\n5 discard user until=14 count=2", is_registered))["M4"],
        Verdict::pass)
        << "a thread that ran a callback emits three events";
  }
  auto trace = trace_of(crashed + kLoss);
  trace.erase<CallbackInit>();
  EXPECT_EQ(Verified(trace)["M4"], Verdict::inconclusive) << "it was seen to move, unannounced";
}

TEST(MappingPersistent, PassesWhereTheInstancesOfAnUnannouncedCallbackAreSeenFromTheFirstOn) {
  auto trace = trace_of(
      "process app crash\ncallback fusion\n"
      "1 discard user until=5 count=6\n10 start fusion\n12 end fusion");
  trace.erase<CallbackInit>();
  EXPECT_EQ(Verified(trace)["M4"], Verdict::pass);
}

// Two CPUs' events of one nanosecond have no order.
TEST(MappingPersistent, IsInconclusiveForARegistrationAtTheTimeOfARunBesideIt) {
  for (const auto* time : {"12", "30"}) {
    const Verified verified(std::string(kReplaced) + "\n" + time + " init fusion cpu=1");
    EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::inconclusive) << time;
    EXPECT_THAT(verified.evidence("M4", "callback fusion"),
                HasSubstr(std::string(time) + " callback_init"));
  }
  EXPECT_EQ(Verified(std::string(kReplaced) + "\n11 init fusion cpu=1")["M4"], Verdict::fail);
  EXPECT_EQ(Verified(std::string(kReplaced) + "\n31 init fusion cpu=1")["M4"], Verdict::fail);
}

TEST(MappingPersistent, IsInconclusiveWhenTheExitWasLost) {
  auto trace = trace_of(kReplaced);
  trace.erase<ThreadFini>([](const ThreadFini& e, const EventHead&) { return e.tid == 101; });
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M3", "callback fusion"), Verdict::inconclusive);
}

// After its thread_fini a thread may publish, but a callback that starts there is on a thread that
// nobody announced.
constexpr const char* kAfterFini = R"(
  publisher out
  callback fusion pooled
  thread t1 callback of=fusion tid=101
  -500 begin t1
  10 start fusion on=t1
  12 end fusion on=t1
  14 finish t1
  16 publish out on=t1
  30 start fusion on=t1
  32 end fusion on=t1)";

TEST(MappingPersistent, FailsWhenACallbackGoesOnAfterTheEndOfItsThread) {
  const Verified verified(kAfterFini);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M4", "callback fusion"),
              AllOf(HasSubstr("14 thread_fini"), HasSubstr("30 callback_start")));
  EXPECT_EQ(verified.of("M3", "callback fusion"), Verdict::pass) << "one after the other";
}

TEST(MappingPersistent, DoubtsAStartAfterTheEndOfItsThreadWithoutProof) {
  // The thread may have been announced again: a thread_init is missing among those counted.
  const auto counted_more = [] {
    auto trace = trace_of(kAfterFini);
    for (auto& event : trace.events) {
      if (auto* end = std::get_if<RunEnd>(&event.body)) ++end->threads;
    }
    return trace;
  };
  EXPECT_EQ(Verified(counted_more()).of("M4", "callback fusion"), Verdict::inconclusive);
}

TEST(MappingPersistent, IsNotDoubtedForAnExitThatTheKernelAloneSaw) {
  // An instance was lost. User space does not know that the worker had ended by then.
  auto trace = trace_of(R"(
    callback fusion
    thread helper worker tid=300
    kernel
    10 start fusion
    12 end fusion
    14 exit helper
    20 start fusion
    22 end fusion
    30 start fusion
    32 end fusion)");
  trace.erase<CallbackStart>([](const CallbackStart& e, const EventHead&) { return e.seq == 1; });
  trace.erase<CallbackEnd>([](const CallbackEnd& e, const EventHead&) { return e.seq == 1; });
  trace.erase<ThreadFini>([](const ThreadFini& e, const EventHead&) { return e.tid == 300; });
  EXPECT_EQ(Verified(trace).of("M4", "callback fusion"), Verdict::pass);
}

TEST(MappingPersistent, SeesAReusedTid) {
  const Verified verified(R"(
    callback fusion pooled
    thread t1 callback of=fusion tid=101
    thread t2 callback of=fusion tid=101
    -500 begin t1
    10 start fusion on=t1
    12 end fusion on=t1
    14 finish t1
    20 begin t2
    30 start fusion on=t2
    32 end fusion on=t2
    34 finish t2)");
  EXPECT_EQ(verified.of("M3", "callback fusion"), Verdict::pass);
  EXPECT_EQ(verified.of("M4", "callback fusion"), Verdict::fail);
}

// t1 ends, t2 goes on without being registered, and then somebody else with t1's tid exits: where
// the kernel's record has a hole before, that t1 had exited in it cannot be seen.
TEST(MappingPersistent, TakesNoExitBehindAHoleForThatOfAThreadThatEnded) {
  const std::string replaced =
      "callback fusion pooled\n"
      "thread t1 callback of=fusion tid=101\n"
      "thread t2 callback of=fusion tid=102\n"
      "kernel\n"
      "1 begin t1\n10 start fusion on=t1\n12 end fusion on=t1\n14 finish t1\n"
      "16 begin t2\n20 start fusion on=t2\n22 end fusion on=t2\n";
  const auto judged = [&replaced](const std::string& kernel) {
    return Verified(replaced + kernel);
  };
  for (const auto* hole : {"", "15 discard kernel until=18 count=1\n30 exit t1"}) {
    EXPECT_EQ(judged(hole)["M3"], Verdict::pass) << hole;
    EXPECT_EQ(judged(hole)["M4"], Verdict::fail) << hole;
  }
  const auto lived = judged("30 exit t1");  // it was still there
  EXPECT_EQ(lived["M3"], Verdict::fail);
  EXPECT_EQ(lived["M4"], Verdict::pass);
}

}  // namespace
}  // namespace cie::test
