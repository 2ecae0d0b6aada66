#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* kTwo = R"(
  callback fusion
  callback plan
  10 start fusion
  12 end fusion
  20 start plan
  22 end plan)";

TEST(NoForeignWork, FailsWhenAnIsolatedThreadStartsAnothersCallback) {
  EXPECT_EQ(Verified(kTwo).of("M6", "thread 101"), Verdict::pass);
  const Verified verified(std::string(kTwo) + "\n30 start plan on=fusion\n32 end plan on=fusion");
  EXPECT_EQ(verified.of("M6", "thread 101"), Verdict::fail);
  EXPECT_EQ(verified.of("M6", "thread 102"), Verdict::pass);
  EXPECT_THAT(verified.evidence("M6", "thread 101"),
              HasSubstr("30 callback_start started plan (seq 1), which is not its own"));
}

// A thread that serves a group is announced for the callback that the group has then.
TEST(NoForeignWork, IsNoneOfACallbackThatIsMadeLaterInItsGroup) {
  constexpr const char* kLater = R"(
    group both
    callback fusion group=both
    10 start fusion
    12 end fusion
    15 init plan
    20 start plan on=fusion
    22 end plan on=fusion
    callback plan group=both pooled)";
  const Verified verified(kLater, "callback_groups:\n  - id: plan\n    policy: SCHED_IDLE\n");
  EXPECT_EQ(verified.of("M6", "thread 101"), Verdict::pass)
      << verified.evidence("M6", "thread 101");
  EXPECT_EQ(verified["M8"], Verdict::fail) << "it shares the group's thread all the same";
  EXPECT_EQ(verified.of("S1", "callback plan"), Verdict::not_applicable)
      << "no thread was announced for it";
  auto trace = trace_of(kLater);
  ASSERT_NE(trace.erase<CallbackInit>(
                [](const auto& init, const auto&) { return init.logical_id == "plan"; }),
            0U);
  EXPECT_EQ(Verified(trace).of("M6", "thread 101"), Verdict::inconclusive) << "of which group?";
}

TEST(NoForeignWork, JudgesPoolThreadsNot) {
  EXPECT_EQ(Verified("thread t1 pool\ncallback a pooled\n1 start a on=t1\n2 end a on=t1")["M6"],
            Verdict::not_applicable);
}

// From the first wait at -20 to the end at 80: in a callback 0..10, outside it
// -1..0, 10..12, 50..60 and 70..80, hence 23 ns of foreign work in 100 ns.
constexpr const char* kForeignTime = R"(
  callback fusion
  -9000 initial fusion
  -8999 applied fusion
  -100 switch 0 idle fusion
  -20 switch 0 fusion idle state=1
  -1 switch 0 idle fusion
  0 start fusion
  10 end fusion
  12 switch 0 fusion idle state=1
  50 switch 0 idle fusion
  60 switch 0 fusion idle state=1
  70 switch 0 idle fusion
  80 finish fusion
  80 switch 0 fusion idle state=1)";

std::string budget(std::int64_t per_second) {
  return "callback_groups:\n  - id: fusion\n    foreign_work_budget: " + std::to_string(per_second);
}

TEST(NoForeignWork, ComparesTimeOutsideCallbacksWithTheBudgetExactly) {
  EXPECT_EQ(Verified(kForeignTime, budget(230'000'000)).of("M6", "thread 101"), Verdict::pass);
  const Verified above(kForeignTime, budget(229'999'999));
  EXPECT_EQ(above.of("M6", "thread 101"), Verdict::fail);
  EXPECT_THAT(above.evidence("M6", "thread 101"),
              HasSubstr("23 ns on a CPU outside callbacks within 100 ns"));
  EXPECT_EQ(Verified(kForeignTime).of("M6", "thread 101"), Verdict::pass) << "no budget";
}

// Whole up to the wait at 60: 3 ns and 10 ns.
TEST(NoForeignWork, FailsByWhatWasSeenWholeBesideAHole) {
  const auto trace = std::string(kForeignTime) + "\n68 discard kernel until=62 count=1";
  const Verified above(trace, budget(129'999'999));
  EXPECT_EQ(above.of("M6", "thread 101"), Verdict::fail);
  EXPECT_THAT(above.evidence("M6", "thread 101"),
              HasSubstr("at least 13 ns on a CPU outside callbacks within 100 ns"));
  EXPECT_EQ(Verified(trace, budget(130'000'000)).of("M6", "thread 101"), Verdict::inconclusive);
}

TEST(NoForeignWork, SaysOfAThreadThatNeverWaitsThatItDoesNot) {
  auto trace = std::string(kForeignTime);
  for (auto at = trace.find("state=1"); at != std::string::npos; at = trace.find("state=1"))
    trace.replace(at, 7, "state=0");
  const Verified busy(trace, budget(1));
  EXPECT_EQ(busy.of("M6", "thread 101"), Verdict::inconclusive);
  EXPECT_THAT(busy.evidence("M6", "thread 101"),
              HasSubstr("it never waited once it was set up: there is no first wait"));
}

// Its exit comes later.
TEST(NoForeignWork, SaysUntilWhenItCounted) {
  const Verified exited(std::string(kForeignTime) + "\n90 exit fusion", budget(229'999'999));
  EXPECT_THAT(exited.evidence("M6", "thread 101"),
              HasSubstr("\n80  23 ns on a CPU outside callbacks within 100 ns"));
}

TEST(NoForeignWork, CountsNothingOfInstancesBeforeTheFirstWait) {
  const auto trace = std::string(kForeignTime) + "\n-50 start fusion\n-40 end fusion";
  EXPECT_EQ(Verified(trace, budget(229'999'999)).of("M6", "thread 101"), Verdict::fail);
  EXPECT_EQ(Verified(trace, budget(230'000'000)).of("M6", "thread 101"), Verdict::pass);
}

// Threads that nothing is applied to, and waits before something is.
TEST(NoForeignWork, BeginsWithTheFirstWaitOfAConfiguredThread) {
  auto trace = std::string(kForeignTime);
  const auto applied = trace.find("  -8999 applied fusion\n");
  trace.erase(applied, 23);
  EXPECT_EQ(Verified(trace, budget(229'999'999)).of("M6", "thread 101"), Verdict::fail);
  EXPECT_EQ(Verified(trace, budget(230'000'000)).of("M6", "thread 101"), Verdict::pass);
  trace.insert(applied, R"(
  -8999 switch 0 idle fusion
  -8990 switch 0 fusion idle state=1
  -8980 switch 0 idle fusion
  -8970 applied fusion
  -8960 switch 0 fusion idle state=0
)");
  EXPECT_EQ(Verified(trace, budget(229'999'999)).of("M6", "thread 101"), Verdict::fail);
  EXPECT_EQ(Verified(trace, budget(230'000'000)).of("M6", "thread 101"), Verdict::pass);
}

// From -20 to the end at 81: in callbacks 0..10 and 52..81, outside them -1..0, 10..12 and 50..52.
TEST(NoForeignWork, WhatAnInstanceRanThatHasNotEndedIsOfItsCallback) {
  auto trace = "process app pid=100 crash" + std::string(kForeignTime);
  const auto rest = trace.find("  60 switch");
  trace.replace(rest, std::string::npos, "  52 start fusion\n  80 audit fusion");
  EXPECT_EQ(Verified(trace, budget(49'504'951)).of("M6", "thread 101"), Verdict::pass);
  const Verified above(trace, budget(49'504'950));
  EXPECT_THAT(above.evidence("M6", "thread 101"),
              HasSubstr("5 ns on a CPU outside callbacks within 101 ns"));
}

// A stream of another channel ends at 40, with its last packet: what the thread did later is counted, too.
TEST(NoForeignWork, IsCountedToTheEndOfACopyAndOfWhatLttngEndedAsOne) {
  auto text = "process app pid=100 crash" + std::string(kForeignTime);
  text.erase(text.find("  80 finish"));
  const auto evidence = [](const TextTrace& trace) {
    return Verified(trace, budget(1)).evidence("M6", "thread 101");
  };
  const auto whole = trace_of(text);
  const auto with_quiet_stream = [&whole](bool is_copy) {
    auto trace = whole;
    StreamBegin quiet;
    std::uint32_t streams = 0;
    for (auto& event : trace.events) {
      auto* begin = std::get_if<StreamBegin>(&event.body);
      if (begin == nullptr) continue;
      ++streams;
      if (begin->domain != Domain::user) continue;
      begin->writer = is_copy ? PacketWriter::copier : PacketWriter::lttng;
      quiet = *begin;
    }
    const auto add = [&](std::int64_t time, const EventBody& body) {
      trace.events.push_back(
          {.head =
               {.time = {time}, .stream = StreamIndex{streams}, .cpu = {}, .pid = {}, .tid = {}},
           .body = body});
    };
    quiet.channel = 20;
    quiet.is_descriptive = true;
    add(-9000, quiet);
    add(-9000, PacketBegin{});
    add(40, PacketEnd{});
    add(40, StreamEnd{});
    std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
    return trace;
  };
  EXPECT_EQ(evidence(with_quiet_stream(true)), evidence(whole));
  EXPECT_NE(evidence(with_quiet_stream(false)), evidence(whole)) << "it was cut";
}

TEST(NoForeignWork, IsInconclusiveWithoutKernelEventsForABudget) {
  const Verified verified(kTwo, budget(1'000'000'000));
  EXPECT_EQ(verified.of("M6", "thread 101"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M6", "thread 102"), Verdict::pass) << "plan has no budget";
}

TEST(NoForeignWork, IsInconclusiveWhenKernelEventsWereLost) {
  EXPECT_EQ(Verified(std::string(kForeignTime) + "\n20 discard kernel until=30 count=1",
                     budget(229'999'999))
                .of("M6", "thread 101"),
            Verdict::inconclusive);
}

TEST(SingleCallbackGroup, FailsForASharedOrReentrantGroup) {
  EXPECT_EQ(Verified(kTwo).of("M8", "group 0"), Verdict::pass);
  const Verified shared(R"(
    group both
    callback fusion group=both
    callback plan group=both pooled
    10 start fusion
    12 end fusion
    20 start plan on=fusion
    22 end plan on=fusion)");
  EXPECT_EQ(shared.of("M8", "group 0"), Verdict::fail);
  EXPECT_THAT(shared.evidence("M8", "group 0"),
              AllOf(HasSubstr("a group of 2 callbacks of /node: fusion, plan"),
                    HasSubstr("fusion belongs to it"), HasSubstr("plan belongs to it"),
                    HasSubstr("isolated thread 101 serves it")));
  EXPECT_EQ(shared.of("M2", "thread 101"), Verdict::fail);

  const Verified reentrant("group both reentrant\ncallback a group=both\n1 start a\n2 end a");
  EXPECT_EQ(reentrant.of("M8", "group 0"), Verdict::fail);
}

// The first one was destroyed, as is told, before the second one was made; or its end is among what was lost.
TEST(SingleCallbackGroup, DoesNotTakeALostEndForALife) {
  constexpr auto kInTurn = R"(
    group both
    callback fusion group=both
    callback plan group=both
    10 start fusion
    12 end fusion
    14 fini fusion
    22 start plan
    24 end plan)";
  const auto registered_late = [](const std::string& text) {
    auto trace = trace_of(text);
    for (auto& event : trace.events) {
      const auto* init = std::get_if<CallbackInit>(&event.body);
      if (init != nullptr && init->logical_id == "plan") event.head.time = {20};
    }
    std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
    return trace;
  };
  EXPECT_EQ(Verified(registered_late(kInTurn)).of("M8", "group 0"), Verdict::pass);
  auto trace = registered_late(std::string(kInTurn) + "\n16 discard user until=18 count=1");
  trace.erase<CallbackFini>([](const auto&, const EventHead& head) { return head.time.ns == 14; });
  const Verified lost(trace);
  EXPECT_EQ(lost.of("M8", "group 0"), Verdict::inconclusive);
  EXPECT_THAT(lost.evidence("M8", "group 0"), HasSubstr("its callback_fini was not seen"));
  // No loss is told, yet a process that ended in order has told it.
  const auto without_end = [&](const std::string& more) {
    auto untold = registered_late(kInTurn + more);
    untold.erase<CallbackFini>(
        [](const auto&, const EventHead& head) { return head.time.ns == 14; });
    return Verified(untold).of("M8", "group 0");
  };
  EXPECT_EQ(without_end(""), Verdict::inconclusive);
  EXPECT_EQ(without_end("\n30 start fusion\n32 end fusion"), Verdict::fail) << "it lived on";
  // Nor does a process without run_end prove that nothing is missing.
  const std::string crashed = std::string("process app crash") + kInTurn;
  auto untold = registered_late(crashed);
  untold.erase<CallbackFini>();
  EXPECT_EQ(Verified(untold).of("M8", "group 0"), Verdict::inconclusive);
}

// Who attaches is told what lives, also where none of it runs.
TEST(SingleCallbackGroup, FailsForThoseThatWereAnnouncedTogether) {
  constexpr auto kIdle = R"(
    group both
    callback fusion group=both
    callback plan group=both
    22 start plan
    24 end plan)";
  const auto recorded = [&](const std::string& process) {
    auto trace = trace_of(process + kIdle);
    for (auto& event : trace.events) {
      const auto* init = std::get_if<CallbackInit>(&event.body);
      if (init != nullptr && init->logical_id == "plan") event.head.time.ns += 5;
    }
    std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
    return Verified(trace).of("M8", "group 0");
  };
  EXPECT_EQ(recorded("process app attached crash"), Verdict::fail);
  EXPECT_EQ(recorded("process app crash"), Verdict::inconclusive);
}

TEST(SingleCallbackGroup, JudgesGroupsOfPoolsNot) {
  EXPECT_EQ(Verified("group g reentrant\nthread t1 pool\ncallback a group=g pooled\n"
                     "1 start a on=t1\n2 end a on=t1")["M8"],
            Verdict::not_applicable);
}

// As a thread's announcement says that has no group.
void forget_groups_of_threads(test::TextTrace& trace) {
  for (auto& event : trace.events) {
    if (auto* init = std::get_if<ThreadInit>(&event.body)) init->group = kNoGroup;
  }
}

TEST(SingleCallbackGroup, OfAThreadIsThatOfItsCallback) {
  auto trace = trace_of(kTwo);
  forget_groups_of_threads(trace);
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M8", "group 0"), Verdict::pass);
  EXPECT_EQ(verified.of("M8", "group 1"), Verdict::pass);
  EXPECT_EQ(verified["M8"], Verdict::pass);
}

TEST(SingleCallbackGroup, IsNamedByItsThreadWhereNothingTellsIt) {
  auto trace = trace_of(kTwo);
  forget_groups_of_threads(trace);
  for (auto& event : trace.events) {
    if (auto* init = std::get_if<CallbackInit>(&event.body)) init->group = kNoGroup;
  }
  trace.erase<GroupInit>();
  const Verified verified(trace);
  EXPECT_EQ(verified.of("M8", "group of thread 101"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M8", "group of thread 102"), Verdict::inconclusive);
}

TEST(SingleCallbackGroup, IsInconclusiveWhenTheGroupIsUnknown) {
  auto trace = trace_of(kTwo);
  trace.erase<GroupInit>(
      [](const GroupInit& e, const EventHead&) { return e.group == GroupId{0}; });
  EXPECT_EQ(Verified(trace).of("M8", "group 0"), Verdict::inconclusive);
  EXPECT_EQ(Verified(trace).of("M8", "group 1"), Verdict::pass);

  trace = trace_of(kTwo);
  trace.erase<CallbackInit>(
      [](const CallbackInit& e, const EventHead&) { return e.callback == CallbackId{0}; });
  EXPECT_EQ(Verified(trace).of("M8", "group 0"), Verdict::inconclusive);
}

constexpr const char* kUnannounced = R"(
  thread stray pool silent
  callback fusion pooled
  10 start fusion on=stray
  12 end fusion on=stray)";

// An executor reads back the threads that it announces.
TEST(ThreadKnown, IsInconclusiveForAThreadThatWasReadBack) {
  const auto judged = [](const std::string& read_back) {
    return Verified("callback fusion pooled\nthread t1 pool silent\n" + read_back +
                    "\n10 start fusion on=t1\n12 end fusion on=t1")["M9"];
  };
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_EQ(judged("5 audit t1"), Verdict::inconclusive);
}

TEST(ThreadKnown, FailsForAThreadThatWasNeverAnnounced) {
  EXPECT_EQ(Verified(kTwo).of("M9", "thread 101"), Verdict::pass);
  const Verified verified(kUnannounced);
  EXPECT_EQ(verified.of("M9", "thread 101"), Verdict::fail);
  EXPECT_THAT(verified.evidence("M9", "thread 101"), HasSubstr("10 callback_start"));
}

TEST(ThreadKnown, IsInconclusiveWithoutProofAndSoAreTheRulesOfIsolatedThreads) {
  auto trace = trace_of(kTwo);
  trace.erase<ThreadInit>([](const ThreadInit& e, const EventHead&) { return e.tid == 101; });
  const Verified verified(trace, "callback_groups:\n  - id: fusion\n    policy: SCHED_OTHER\n");
  EXPECT_EQ(verified.of("M9", "thread 101"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M6", "thread 101"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M8", "group 0"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("S1", "callback fusion"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("S2", "callback fusion"), Verdict::inconclusive);
  EXPECT_EQ(verified.of("M9", "thread 102"), Verdict::pass);
  EXPECT_EQ(verified.of("M6", "thread 102"), Verdict::pass);
}

constexpr const char* kPublishesAfterFini = R"(
  publisher out
  callback fusion
  10 start fusion
  12 end fusion
  14 finish fusion
  16 publish out on=fusion)";

TEST(ThreadKnown, FailsForACallbackThatStartsAfterTheEndOfItsThread) {
  EXPECT_EQ(Verified(kPublishesAfterFini)["M9"], Verdict::pass)
      << "a thread may publish after its end";
  const Verified verified(std::string(kPublishesAfterFini) + "\n30 start fusion\n32 end fusion");
  EXPECT_EQ(verified["M9"], Verdict::fail);
  const auto& subjects = verified.rule("M9").subjects;
  ASSERT_EQ(subjects.size(), 2U) << "the thread that ended, and one that is not known";
  EXPECT_EQ(subjects[0].verdict, Verdict::pass);
  EXPECT_EQ(subjects[0].subject, subjects[1].subject);
  ASSERT_GE(subjects[1].evidence.size(), 2U);
  EXPECT_EQ(subjects[1].evidence[0].event, "thread_fini");
  EXPECT_EQ(subjects[1].evidence[0].time->ns, 14);
  EXPECT_EQ(subjects[1].evidence[1].time->ns, 30);
}

TEST(ThreadKnown, AcceptsAThreadThatIsAnnouncedAnewAfterItsEnd) {
  const Verified verified(std::string(kPublishesAfterFini) +
                          "\n-500 begin fusion"
                          "\n20 begin fusion\n30 start fusion\n32 end fusion\n40 finish fusion");
  EXPECT_EQ(verified["M9"], Verdict::pass);
}

TEST(ThreadKnown, DoubtsAStartAfterTheEndOfItsThreadWithoutProof) {
  auto trace = trace_of(std::string(kPublishesAfterFini) + "\n30 start fusion\n32 end fusion");
  trace.erase<RunEnd>();
  const Verified verified(trace);
  EXPECT_EQ(verified["M9"], Verdict::inconclusive);
  EXPECT_EQ(verified["M6"], Verdict::inconclusive) << "what the thread is, is not known";
}

TEST(ThreadKnown, DoubtsAThreadWhoseEndWasLost) {
  // What started after the thread's end then looks like what started before it.
  auto trace = trace_of(std::string(kPublishesAfterFini) + "\n30 start fusion\n32 end fusion");
  trace.erase<ThreadFini>();
  EXPECT_EQ(Verified(trace)["M9"], Verdict::inconclusive);
  trace.erase<RunEnd>();  // the recording ended before the process
  EXPECT_EQ(Verified(trace)["M9"], Verdict::pass);
}

TEST(ThreadKnown, IsInconclusiveWithoutTheContextVtid) {
  auto trace = trace_of(kTwo);
  for (auto& event : trace.events)
    event.head.tid.reset();
  const Verified verified(trace);
  for (const auto* rule : {"M2", "M4", "M6", "M9", "E3"}) {
    EXPECT_EQ(verified.of(rule, "trace"), Verdict::inconclusive) << rule;
  }
}

// It works for nobody, though the spec allows it little.
TEST(NoForeignWork, JudgesAThreadWhoseCallbackNeverRan) {
  const std::string idle = R"(
  callback fusion
  callback plan
  -20 switch 0 idle fusion
  -10 switch 0 fusion idle state=1
  0 switch 0 idle fusion
  60 switch 0 fusion idle state=1
  70 start plan
  72 end plan
  80 finish fusion)";
  EXPECT_EQ(Verified(idle, budget(1'000'000)).of("M6", "thread 101"), Verdict::fail);
  EXPECT_NE(Verified(idle, budget(900'000'000)).of("M6", "thread 101"), Verdict::fail);
}

// As where the file of its starts and ends is missing, of a process that was killed.
TEST(NoForeignWork, TakesNothingForForeignWhereNoTotalTellsThatNoInstanceIsMissing) {
  const std::string killed = R"(
  process app crash
  callback fusion
  callback plan
  -20 switch 0 idle fusion
  -10 switch 0 fusion idle state=1
  0 switch 0 idle fusion
  60 switch 0 fusion idle state=1
  70 start plan
  72 end plan
  80 finish fusion)";
  EXPECT_EQ(Verified(killed, budget(1'000'000)).of("M6", "thread 101"), Verdict::inconclusive);
  EXPECT_EQ(Verified(killed, budget(900'000'000)).of("M6", "thread 101"), Verdict::pass);
  EXPECT_EQ(Verified(killed + "\n  81 fini fusion", budget(1'000'000)).of("M6", "thread 101"),
            Verdict::fail);
}

// What was made when the former one was gone did not wait for it.
TEST(SingleCallbackGroup, CountsThoseThatLivedTogether) {
  const std::string group = R"(
    group g
    callback former group=g
    callback latter group=g id=/later
    10 start former
    12 end former
    14 finish former
    )";
  const std::string latter = "\n20 init latter\n21 begin latter\n30 start latter\n32 end latter";
  const auto ended_at = [&](const char* time) {
    auto trace = trace_of(group + time + " fini former" + latter);
    trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
      return head.time.ns < 0 && to_number(e.callback) == 1;
    });
    return Verified(trace)["M8"];
  };
  EXPECT_EQ(ended_at("15"), Verdict::pass);
  EXPECT_EQ(ended_at("25"), Verdict::fail);
}

}  // namespace
}  // namespace cie::test
