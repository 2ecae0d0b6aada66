// What is taken away moves a verdict towards INCONCLUSIVE, never from FAIL to PASS and never to a false
// FAIL (law L2): events that no number tells of are judged by where the tracer lost any.
#include "support/verdicts.hpp"

#include <algorithm>
#include <deque>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::HasSubstr;

template <typename Body>
TextTrace without_first(TextTrace trace) {
  bool is_gone = false;
  trace.erase<Body>(
      [&is_gone](const Body&, const EventHead&) { return !std::exchange(is_gone, true); });
  return trace;
}

TEST(LostEvent, OfAnAttachedQueueMayHaveToldOfALostSample) {
  const std::string trace = R"(
    process app attached crash
    callback fusion subscription topic=/a next=7
    5 release fusion
    10 start fusion
    12 end fusion
    20 release fusion
    22 start fusion
    24 end fusion)";
  EXPECT_EQ(Verified(trace)["Q1"], Verdict::pass);
  EXPECT_EQ(Verified(trace + "\n14 lost fusion count=2")["Q1"], Verdict::fail);
  EXPECT_EQ(Verified(trace + "\n14 discard user until=15 count=1")["Q1"], Verdict::inconclusive);
}

// Running totals stand for those that a crash took only where the process was attached to.
TEST(LostEvent, OfTheFirstRunBeginMakesNoAttachedProcess) {
  const std::string crash = R"(
    process app crash
    callback fusion subscription topic=/a
    -20 reload
    -15 init fusion
    10 release fusion
    11 start fusion
    12 end fusion)";
  ASSERT_EQ(Verified(crash)["Q1"], Verdict::inconclusive);
  const auto before = [](std::int64_t time) {
    return [time](const auto&, const EventHead& head) { return head.time.ns < time; };
  };
  auto trace = trace_of(crash);
  trace.erase<RunBegin>(before(-20));
  EXPECT_EQ(Verified(trace)["Q1"], Verdict::inconclusive);
  auto lossy = trace_of(crash + "\n-9000 discard user until=-8990 count=9");
  lossy.erase<RunBegin>(before(-20));
  lossy.erase<CallbackInit>(before(-20));
  EXPECT_EQ(Verified(lossy)["Q1"], Verdict::inconclusive);
}

TEST(LostEvent, RunEndHidesNoInstanceThatTheTotalsSayNeverEnded) {
  auto trace = trace_of(R"(
    callback plan timer period=100
    10 start plan release=10
    20 end plan
    110 start plan release=110
    900 fini plan)");
  constexpr const char* kDeadline = "callback_groups:\n  - id: plan\n    response_deadline: 50\n";
  ASSERT_EQ(Verified(trace, kDeadline)["R3"], Verdict::fail);
  trace.erase<RunEnd>();
  EXPECT_EQ(Verified(trace, kDeadline)["R3"], Verdict::fail);
}

constexpr const char* kRanAfterItsThreadsEnd = R"(
    callback fusion
    10 start fusion
    12 end fusion
    20 finish fusion
    30 start fusion
    32 end fusion)";

TEST(LostEvent, OfAThreadsEndLeavesOpenWhereItsCallbacksRanAfterwards) {
  auto trace = trace_of(kRanAfterItsThreadsEnd);
  ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
  trace.erase<ThreadFini>();
  EXPECT_EQ(Verified(trace)["M4"], Verdict::inconclusive);
}

constexpr const char* kReplacedThread = R"(
    process app
    callback fusion pooled
    thread former callback of=fusion tid=101
    thread latter callback of=fusion tid=102
    -90 begin former
    10 start fusion on=former
    12 end fusion on=former
    14 finish former
    18 begin latter
    20 start fusion on=latter
    22 end fusion on=latter)";
std::string registered_anew() { return std::string(kReplacedThread) + "\n16 init fusion"; }

TEST(LostEvent, MayHaveRegisteredACallbackAgainThatMovedOn) {
  auto trace = trace_of(registered_anew());
  ASSERT_EQ(Verified(trace)["M4"], Verdict::pass);
  const auto is_second = [](const CallbackInit&, const EventHead& head) {
    return head.time.ns == 16;
  };
  trace.erase<CallbackInit>(is_second);
  EXPECT_EQ(Verified(trace)["M4"], Verdict::fail) << "nothing was lost";
  auto lossy = trace_of(registered_anew() + "\n15 discard user until=17 count=1");
  lossy.erase<CallbackInit>(is_second);
  EXPECT_EQ(Verified(lossy)["M4"], Verdict::inconclusive);
  auto elsewhere = trace_of(registered_anew() + "\n30 discard user until=31 count=1");
  elsewhere.erase<CallbackInit>(is_second);
  EXPECT_EQ(Verified(elsewhere)["M4"], Verdict::fail);
}

TEST(LostEvent, EndOfACallbackHidesNoLifetimeOfItsId) {
  auto trace = trace_of(R"(
    callback former id=/n@Timer timer period=10
    callback latter id=/n@Timer timer period=10
    1 initial former
    2 applied former policy=fifo priority=50
    10 start former
    12 end former
    14 finish former
    15 fini former
    20 init latter
    21 begin latter
    22 initial latter
    23 applied latter policy=other
    30 start latter
    32 end latter)");
  trace.erase<CallbackInit>([](const CallbackInit& e, const EventHead& head) {
    return head.time.ns < 0 && to_number(e.callback) == 1;
  });
  ASSERT_EQ(Verified(trace)["M5"], Verdict::fail);
  trace.erase<CallbackFini>(
      [](const CallbackFini&, const EventHead& head) { return head.time.ns == 15; });
  EXPECT_EQ(Verified(trace)["M5"], Verdict::inconclusive);
}

// Its end tells where it ran.
TEST(LostEvent, OfAStartHidesNoThread) {
  constexpr const char* kStray = R"(
    callback fusion
    callback plan
    thread stranger worker silent tid=190
    10 start fusion
    12 end fusion
    20 start plan
    22 end plan
    30 start fusion on=)";
  for (const auto* where : {"plan", "stranger"}) {
    const auto trace = trace_of(std::string(kStray) + where + "\n34 end fusion on=" + where +
                                "\n40 start fusion\n44 end fusion");
    auto lossy = trace;
    lossy.erase<CallbackStart>(
        [](const CallbackStart&, const EventHead& head) { return head.time.ns == 30; });
    const Verified whole(trace);
    const Verified judged(lossy);
    const std::string thread = where == std::string_view("plan") ? "thread 102" : "thread 190";
    for (const auto* rule : {"M2", "M6", "M9"}) {
      if (whole.of(rule, thread) != Verdict::fail) continue;
      EXPECT_NE(judged.of(rule, thread), Verdict::pass) << rule << ' ' << where;
      EXPECT_NE(judged.of(rule, thread), Verdict::not_applicable) << rule << ' ' << where;
    }
    EXPECT_EQ(whole["M3"], Verdict::fail);
    EXPECT_EQ(judged["M3"], Verdict::fail) << where;
  }
  const auto moved = trace_of(std::string(kStray) + "plan\n34 end fusion on=plan");
  EXPECT_THAT(Verified(without_first<CallbackStart>(moved)).evidence("M2", "thread 102"),
              HasSubstr("fusion"));
}

// Nor where it moved from or to.
TEST(LostEvent, OfAStartHidesNoMove) {
  for (const auto start : {10, 20}) {
    auto trace = trace_of(kReplacedThread);
    ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
    trace.erase<CallbackStart>(
        [start](const CallbackStart&, const EventHead& head) { return head.time.ns == start; });
    const Verified judged(trace);
    EXPECT_EQ(judged["M4"], Verdict::fail) << start;
    EXPECT_THAT(judged.evidence("M4", "callback fusion"),
                HasSubstr(start == 20 ? "22 callback_end went on on thread 102"
                                      : "20 callback_start went on on thread 102"));
  }
}

// Though another one starts in the nanosecond of its end.
TEST(LostEvent, OfAStartIsNotTakenForTheNextOne) {
  auto trace = trace_of(std::string(kReplacedThread) +
                        "\n22 start fusion on=latter\n24 end fusion on=latter");
  trace.erase<CallbackStart>(
      [](const CallbackStart&, const EventHead& head) { return head.time.ns == 20; });
  EXPECT_THAT(Verified(trace).evidence("M4", "callback fusion"),
              HasSubstr("22 callback_end went on on thread 102"));
}

// Whether a callback_init registers its callback anew depends on it.
TEST(LostEvent, OfARunBeginMayHaveAnnouncedACallbackThatMovedOn) {
  const std::string announced = registered_anew() + "\n15 reload";
  const auto is_reload = [](const RunBegin&, const EventHead& head) { return head.time.ns == 15; };
  ASSERT_EQ(Verified(announced)["M4"], Verdict::fail);
  auto lossy = trace_of(announced + "\n14 discard user until=15 count=1");
  lossy.erase<RunBegin>(is_reload);
  EXPECT_EQ(Verified(lossy)["M4"], Verdict::inconclusive);
  auto elsewhere = trace_of(registered_anew() + "\n30 discard user until=31 count=1");
  EXPECT_EQ(Verified(elsewhere)["M4"], Verdict::pass);
  auto without_any = trace_of(announced);
  without_any.erase<RunBegin>();
  EXPECT_EQ(Verified(without_any)["M4"], Verdict::inconclusive);
  // The first callback_init that was seen.
  const auto is_first = [](const CallbackInit&, const EventHead& head) { return head.time.ns < 0; };
  auto attached = trace_of(announced);
  attached.erase<CallbackInit>(is_first);
  EXPECT_EQ(Verified(attached)["M4"], Verdict::fail);
}

// One that may have begun after its thread's end.
TEST(LostEvent, OfAStartLeavesOpenWhetherItsThreadHadEnded) {
  auto trace = trace_of(kRanAfterItsThreadsEnd);
  ASSERT_EQ(Verified(trace)["M9"], Verdict::fail);
  trace.erase<CallbackStart>(
      [](const CallbackStart&, const EventHead& head) { return head.time.ns == 30; });
  const Verified judged(trace);
  EXPECT_EQ(judged["M9"], Verdict::inconclusive);
  EXPECT_EQ(judged["M4"], Verdict::inconclusive);
}

// Its thread_fini is then lost as well.
TEST(LostEvent, OfAThreadsLifeLeavesOpenWhetherItsCallbackMoved) {
  auto trace = trace_of(kRanAfterItsThreadsEnd);
  ASSERT_EQ(Verified(trace)["M4"], Verdict::fail);
  trace.erase<ThreadInit>();
  trace.erase<ThreadSched>();
  trace.erase<ThreadFini>();
  EXPECT_EQ(Verified(trace)["M4"], Verdict::inconclusive);
}

// A callback without a thread of its own of which no run was seen may have run on any.
TEST(LostEvent, OfTheOnlyRunOfACallbackLeavesOpenWhereItRan) {
  constexpr const char* kOnThreadOfAnother = R"(
    callback fusion
    callback plan pooled
    10 start fusion
    18 end fusion
    20 start plan on=fusion
    22 end plan on=fusion)";
  constexpr const char* kInsideAnother = R"(
    callback fusion
    callback plan pooled
    10 start fusion
    12 start plan on=fusion
    14 end plan on=fusion
    18 end fusion)";
  constexpr const char* kOnAStranger = R"(
    callback fusion
    callback plan pooled
    thread stranger worker silent tid=190
    10 start fusion
    18 end fusion
    20 start plan on=stranger
    22 end plan on=stranger)";
  const std::pair<const char*, std::vector<const char*>> cases[] = {
      {kOnThreadOfAnother, {"M2", "M6"}},
      {kInsideAnother, {"M2", "M6", "E3"}},
      {kOnAStranger, {"M9"}},
  };
  for (const auto& [text, rules] : cases) {
    auto trace = trace_of(text);
    const Verified whole(trace);
    const auto is_of_plan = [](const auto& event, const EventHead&) {
      return to_number(event.callback) == 1;
    };
    trace.erase<CallbackStart>(is_of_plan);
    trace.erase<CallbackEnd>(is_of_plan);
    const Verified judged(trace);
    trace.erase<CallbackInit>(is_of_plan);
    trace.erase<CallbackFini>(is_of_plan);
    const Verified without_all(trace);
    for (const auto* rule : rules) {
      ASSERT_EQ(whole[rule], Verdict::fail) << rule;
      EXPECT_EQ(judged[rule], Verdict::inconclusive) << rule << text;
      EXPECT_EQ(without_all[rule], Verdict::inconclusive) << rule << text;
    }
  }
}

// Not even one that has a thread of its own, beside which its only run was: or its second one.
TEST(LostEvent, OfTheOnlyRunOfACallbackLeavesOpenWhetherItsThreadWasKnown) {
  constexpr const char* kAlone = R"(
    callback fusion
    thread stranger worker silent tid=190
    10 start fusion on=stranger
    12 end fusion on=stranger)";
  constexpr const char* kInAGroup = R"(
    group both
    callback plan group=both
    callback fusion group=both pooled
    thread stranger worker silent tid=190
    5 start plan
    6 end plan
    10 start fusion on=stranger
    12 end fusion on=stranger)";
  for (const auto* text : {kAlone, kInAGroup}) {
    auto trace = trace_of(text);
    ASSERT_EQ(Verified(trace)["M9"], Verdict::fail);
    trace.erase<CallbackStart>(
        [](const CallbackStart&, const EventHead& head) { return head.time.ns == 10; });
    trace.erase<CallbackEnd>(
        [](const CallbackEnd&, const EventHead& head) { return head.time.ns == 12; });
    const Verified judged(trace);
    EXPECT_EQ(judged["M9"], Verdict::inconclusive) << text;
    EXPECT_EQ(judged.of("M9", "thread 101"), Verdict::inconclusive) << text;
  }
}

// Of a process of which no thread is known to have run anything, the process is in doubt.
TEST(LostEvent, OfEveryRunLeavesOpenWhereAllOfThemRan) {
  const auto pooled = trace_of(R"(
    process app executor=multi_threaded
    thread t1 pool tid=101
    thread stranger worker silent tid=190
    callback fusion pooled
    callback plan pooled
    10 start fusion on=t1
    12 start plan on=t1
    14 end plan on=t1
    18 end fusion on=t1
    20 start plan on=stranger
    22 end plan on=stranger)");
  const Verified whole(pooled);
  auto lossy = pooled;
  lossy.erase<CallbackStart>();
  lossy.erase<CallbackEnd>();
  const Verified judged(lossy);
  for (const auto* rule : {"M2", "M9", "E3"}) {
    ASSERT_EQ(whole[rule], Verdict::fail) << rule;
    EXPECT_EQ(judged[rule], Verdict::inconclusive) << rule;
    EXPECT_EQ(judged.of(rule, "process 100"), Verdict::inconclusive) << rule;
  }
  auto none =
      trace_of("process app executor=multi_threaded\nthread t1 pool\ncallback fusion pooled");
  for (const auto* rule : {"M2", "M9", "E3"})
    EXPECT_EQ(Verified(none)[rule], Verdict::not_applicable) << rule;
}

// Nothing counts the callbacks of a process that crashed.
TEST(LostEvent, MayHaveTakenAWholeCallbackOfACrashedProcess) {
  const std::string crash = R"(
    process app crash
    callback fusion
    callback plan pooled
    10 start fusion
    12 end fusion
    20 start plan on=fusion
    22 end plan on=fusion
    30 start fusion
    32 end fusion)";
  const auto without_plan = [](const std::string& text) {
    auto trace = trace_of(text);
    const auto is_of_plan = [](const auto& event, const EventHead&) {
      return to_number(event.callback) == 1;
    };
    trace.erase<CallbackInit>(is_of_plan);
    trace.erase<CallbackStart>(is_of_plan);
    trace.erase<CallbackEnd>(is_of_plan);
    return Verified(trace);
  };
  const auto lossy = without_plan(crash + "\n19 discard user until=23 count=3");
  const auto silent = without_plan(crash);
  for (const auto* rule : {"M2", "M6"}) {
    ASSERT_EQ(Verified(crash)[rule], Verdict::fail) << rule;
    EXPECT_EQ(lossy[rule], Verdict::inconclusive) << rule;
    EXPECT_EQ(silent[rule], Verdict::pass) << rule << ": nothing tells of a loss";
  }
}

TEST(LostEvent, AtTheStartHidesNoGroupOfSeveralCallbacks) {
  auto trace = trace_of(R"(
    group both
    callback fusion group=both
    callback plan group=both pooled
    10 start fusion
    12 end fusion
    20 start plan on=fusion
    22 end plan on=fusion)");
  ASSERT_EQ(Verified(trace)["M8"], Verdict::fail);
  trace.erase<GroupInit>();
  trace.erase<CallbackInit>();
  trace.erase<ThreadInit>();
  EXPECT_EQ(Verified(trace)["M8"], Verdict::inconclusive);
}

// However many losses there are, none of them is forgotten.
TEST(LostEvent, BeyondAHundredThousandIsStillALoss) {
  auto trace = trace_of("process app crash\ncallback fusion\n10 start fusion\n12 end fusion");
  ASSERT_EQ(Verified(trace)["M3"], Verdict::pass);
  const auto end = std::ranges::find_if(trace.events, [](const Event& event) {
    return std::holds_alternative<PacketEnd>(event.body);
  });
  ASSERT_NE(end, trace.events.end());
  const auto last = end->head;
  std::vector<Event> losses;
  for (std::int64_t i = 0; i < 100'010; ++i) {
    auto head = last;
    head.time = Timestamp{i < 100'005 ? -1'000 : 20};
    losses.push_back(
        {.head = head,
         .body = Discarded{.begin = {head.time.ns - 1}, .end = head.time, .count = 1}});
  }
  trace.events.insert(end, losses.begin(), losses.end());
  EXPECT_EQ(Verified(trace)["M3"], Verdict::inconclusive);
}

// Each is told in words of its own, so the list has no room for the last one.
TEST(LostEvent, ThatTheListHasNoRoomForIsStillALoss) {
  const auto judged = [](std::size_t damaged) {
    auto trace = trace_of(R"(
      callback fusion pooled
      thread one callback of=fusion tid=101
      thread two callback of=fusion tid=102
      10 start fusion on=one
      12 end fusion on=one
      14 finish one
      20 begin two
      30 start fusion on=two
      32 end fusion on=two
      34 finish two)");
    std::deque<std::string> reasons;
    std::vector<Event> losses;
    const auto damage = [&](std::int64_t time) {
      EventHead head = trace.events.front().head;
      head.time = Timestamp{time};
      const auto& reason = reasons.emplace_back("byte " + std::to_string(reasons.size()));
      losses.push_back(
          {.head = head,
           .body = DamagedPacket{.reason = reason, .begin = head.time, .end = head.time}});
    };
    for (std::size_t i = 0; i < damaged; ++i)
      damage(2'000);
    damage(16);
    trace.events.insert(trace.events.end(), losses.begin(), losses.end());
    return Verified(trace)["M4"];
  };
  EXPECT_EQ(judged(1), Verdict::inconclusive);
  EXPECT_EQ(judged(100'000), Verdict::inconclusive);
}

// L2: the end on CPU 2 is what shows it there; its switches, where they were recorded, show it too.
TEST(LostEvents, HideWhichCpusAThreadUsed) {
  const auto judged = [](const std::string& switches, bool is_lost) {
    auto trace =
        trace_of("callback fusion\n-90 applied fusion policy=fifo priority=80 cpus=0\n" + switches +
                 "10 start fusion\n12 end fusion cpu=2\n" + "20 start fusion\n22 end fusion");
    if (is_lost) {
      trace.erase<CallbackEnd>([](const CallbackEnd& e, const EventHead&) { return e.seq == 0; });
    }
    return Verified(trace).of("S4", "thread 101");
  };
  EXPECT_EQ(judged("", false), Verdict::fail);
  EXPECT_EQ(judged("", true), Verdict::inconclusive);
  EXPECT_EQ(judged("9 switch 0 idle fusion next_prio=19\n", true), Verdict::pass);
  EXPECT_EQ(judged("9 switch 2 idle fusion next_prio=19\n", true), Verdict::fail);
}

// The text's losses are those of CPU 0, where plan's own thread may not run: another one ran it.
TEST(LostEvents, HideAnInstanceOnAThreadThatMayUseTheirCpu) {
  const auto judged = [](const std::string& cpus, const std::string& loss) {
    auto trace = trace_of(R"(
      callback fusion
      callback plan cpu=1
      thread w worker cpu=2
      -95 initial plan cpus=)" +
                          cpus + "\n-90 applied plan cpus=" + cpus + R"(
      10 start fusion
      12 end fusion
      20 start plan
      22 end plan
      24 start plan on=fusion cpu=0
      26 end plan on=fusion cpu=0
      30 start plan
      32 end plan
      )" + loss);
    const auto is_lost = [](const auto& event, const EventHead& head) {
      return event.seq == 1 && head.time.ns < 30;
    };
    if (!loss.empty()) {
      trace.erase<CallbackStart>(is_lost);
      trace.erase<CallbackEnd>(is_lost);
    }
    return Verified(trace);
  };
  const std::string loss = "23 discard user until=27 count=2";
  const auto whole = judged("1", "");
  const auto lossy = judged("1", loss);
  for (const auto* rule : {"M2", "M6"}) {
    EXPECT_EQ(whole.of(rule, "thread 101"), Verdict::fail) << rule;
    EXPECT_EQ(lossy.of(rule, "thread 101"), Verdict::inconclusive) << rule;
    EXPECT_EQ(judged("0,1", loss).of(rule, "thread 101"), Verdict::pass) << "plan's own may have";
    EXPECT_EQ(judged("1", "40 discard user until=41 count=2").of(rule, "thread 101"), Verdict::pass)
        << "nothing was lost then";
  }
}

// All that its end counts was seen since somebody attached to it.
TEST(LostEvent, TakesNothingOfAnAttachedProcessWhoseTotalsAgree) {
  const Verified verified(R"(
    process app attached
    callback fusion
    5 discard user until=8 count=3
    10 start fusion
    12 end fusion)");
  for (const auto* rule : {"M2", "M6", "M7", "M8", "M9", "E3"})
    EXPECT_EQ(verified[rule], Verdict::pass) << rule;
}

}  // namespace
}  // namespace cie::test
