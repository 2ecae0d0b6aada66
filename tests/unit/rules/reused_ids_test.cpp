// Tids and pids are given anew. Where the end of who had one and the beginning of the next are lost, the
// two are not told apart, and nothing that follows from their being one fails.
#include "reused_tid.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

constexpr auto kOfPlan = [](const auto& event, const EventHead&) {
  return to_number(event.callback) == 1;
};

void erase_end_and_beginning(TextTrace& trace) {
  trace.erase<ThreadFini>(
      [](const ThreadFini&, const EventHead& head) { return head.time.ns == 14; });
  trace.erase<ThreadInit>(kOfPlan);
}

void expect(Verdict expected, const TextTrace& trace) {
  const Verified verified(trace);
  for (const auto* rule : {"M2", "M6"})
    EXPECT_EQ(verified.of(rule, "thread 101"), expected)
        << rule << ' ' << verified.evidence(rule, "thread 101");
}

TEST(ReusedTid, IsNoThreadOfTwoCallbacksWhereEndAndBeginningAreLost) {
  auto trace = of_reused_tid("process app");
  expect(Verdict::pass, trace);
  erase_end_and_beginning(trace);
  expect(Verdict::inconclusive, trace);
  trace.erase<CallbackInit>(kOfPlan);
  expect(Verdict::inconclusive, trace);
}

TEST(ReusedTid, IsNotOfTheCallbackThatTheThreadBeforeWasAnnouncedFor) {
  auto trace = of_reused_tid("process app");
  erase_end_and_beginning(trace);
  const auto is_of_fusion = [](const auto& event, const EventHead&) {
    return to_number(event.callback) == 0;
  };
  trace.erase<CallbackStart>(is_of_fusion);
  trace.erase<CallbackEnd>(is_of_fusion);
  EXPECT_EQ(Verified(trace).of("M6", "thread 101"), Verdict::inconclusive);
}

TEST(ReusedTid, OfAProcessWithoutTotalsMayHaveBeenGivenWhereTheTracerLostEvents) {
  auto lossy = of_reused_tid("process app crash", "\n14 discard user until=18 count=2");
  erase_end_and_beginning(lossy);
  expect(Verdict::inconclusive, lossy);
  auto later = of_reused_tid("process app crash", "\n40 discard user until=41 count=2");
  erase_end_and_beginning(later);
  expect(Verdict::fail, later);
}

// Of both processes that have the pid, in each of which thread 101 is of another callback.
constexpr const char* kRestarted = R"(
    process one pid=100 until=500
    callback a pooled
    callback b pooled
    thread a1 callback of=a tid=101
    thread b1 callback of=b tid=102
    10 start a on=a1
    12 end a on=a1
    20 start b on=b1
    22 end b on=b1
    30 start a on=a1
    32 end a on=a1
    process two pid=100 from=2000
    callback c id=a pooled
    callback d id=b timer pooled
    thread c1 callback of=c tid=102
    thread d1 callback of=d tid=101
    )";

// All that the second one tells of itself before it runs callbacks.
TextTrace without_second_beginning(const std::string& lines) {
  auto trace = trace_of(kRestarted + lines + "\n1999 discard user until=2500 count=30");
  std::erase_if(trace.events, [](const Event& event) {
    const auto time = event.head.time.ns;
    return time >= 2000 && time < 2999 && category_of(event.body) == EventCategory::state;
  });
  return trace;
}

bool is_any_pid_shared(const Verified& verified) {
  return std::ranges::any_of(verified.result.report.defects, [](const TraceDefect& defect) {
    return defect.kind == DefectKind::shared_pid;
  });
}

// A tracer's clock may count microseconds alone: of the exit and the last events of one the exit may be read first.
TEST(ReusedTid, IsNoneOfAThreadWhoseLastEventsHaveTheTimeOfItsExit) {
  const Verified verified(
      "callback fusion\n10 start fusion\n20 exit fusion\n20 end fusion\n"
      "20 finish fusion");
  EXPECT_EQ(verified["T4"], Verdict::pass);
  for (const auto* rule : {"M2", "M9"}) {
    EXPECT_EQ(verified[rule], Verdict::pass) << rule;
    EXPECT_EQ(verified.rule(rule).subjects.size(), 1U) << rule;
  }
}

TEST(ReusedPid, IsOfAnotherProcessAfterTheEndOfWhoUsedItsNumbers) {
  const Verified verified(without_second_beginning(R"(
    3000 start c on=c1
    3002 end c on=c1
    3005 wakeup d on=d1
    3010 start d on=d1
    3012 end d on=d1)"));
  EXPECT_EQ(verified["M3"], Verdict::inconclusive);
  EXPECT_EQ(verified.of("M3", "callback a (pid 100, program 1)"), Verdict::pass);
  EXPECT_FALSE(is_any_pid_shared(verified));
  std::vector<std::uint64_t> instances;
  for (const auto& callback : verified.result.report.callbacks)
    instances.push_back(callback.instances);
  EXPECT_THAT(instances, testing::UnorderedElementsAre(2, 1, 1, 1));
}

// Its numbers go on where those of the first one ended.
TEST(ReusedPid, IsInDoubtBehindALossWhereNumbersTellNothing) {
  const Verified verified(without_second_beginning(R"(
    3000 start c on=c1 seq=2
    3002 end c on=c1
    3005 wakeup d on=d1)"));
  EXPECT_EQ(verified["M3"], Verdict::inconclusive);
  EXPECT_TRUE(is_any_pid_shared(verified));
}

// A crash tells no run_end; that the numbers begin again does.
TEST(ReusedPid, IsInDoubtWhereNumbersBeginAgainBehindALoss) {
  auto crashed = without_second_beginning(R"(
    3000 start c on=c1
    3002 end c on=c1
    3010 start d on=d1
    3012 end d on=d1)");
  crashed.erase<RunEnd>();
  crashed.erase<CallbackFini>();
  const Verified verified(crashed);
  for (const auto* rule : {"M2", "M3", "M6"}) {
    EXPECT_EQ(verified[rule], Verdict::inconclusive);
    for (const auto& subject : verified.rule(rule).subjects)
      EXPECT_NE(subject.verdict, Verdict::fail) << rule << ' ' << subject.subject;
  }
  EXPECT_TRUE(is_any_pid_shared(verified));
  AnalysisOptions behind_loss;
  behind_loss.window = TimeWindow{.from = {2'990}, .to = {4'000}};
  EXPECT_TRUE(is_any_pid_shared(Verified(crashed, {}, behind_loss))) << "what came before it tells";
}

// The same of what is told of a callback once.
TEST(ReusedPid, IsInDoubtWhereACallbackEndsAgainBehindALoss) {
  constexpr const char* kProcess = R"(
    process one crash
    callback a
    10 start a
    12 end a
    20 fini a
    90 fini a)";
  EXPECT_FALSE(is_any_pid_shared(Verified(kProcess)));
  EXPECT_TRUE(
      is_any_pid_shared(Verified(std::string(kProcess) + "\n30 discard user until=80 count=9")));
}

// The same of a node, a group and a publisher, which are told again to sessions that attach alone.
template <typename Made>
TextTrace with_again(const std::string& text) {
  auto trace = trace_of(text);
  const auto made = std::ranges::find_if(
      trace.events, [](const Event& event) { return std::holds_alternative<Made>(event.body); });
  auto again = *made;
  again.head.time = {90};
  const auto later = std::ranges::find_if(
      trace.events, [&again](const Event& event) { return event.head.time > again.head.time; });
  trace.events.insert(later, again);
  return trace;
}

template <typename Made>
void expect_doubt_where_made_again() {
  const auto is_shared = [](const std::string& process, const std::string& more) {
    return is_any_pid_shared(Verified(with_again<Made>("process one crash" + process + R"(
      callback a
      publisher p
      10 start a
      11 publish p on=a
      12 end a
      100 start a
      102 end a
      )" + more)));
  };
  EXPECT_FALSE(is_shared("", ""));
  EXPECT_TRUE(is_shared("", "30 discard user until=80 count=9"));
  EXPECT_FALSE(is_shared("", "92 discard user until=95 count=9"));
  EXPECT_FALSE(is_shared(" attached", "30 discard user until=80 count=9"));
}

TEST(ReusedPid, IsInDoubtWhereWhatIsMadeOnceIsMadeAgainBehindALoss) {
  expect_doubt_where_made_again<NodeInit>();
  expect_doubt_where_made_again<GroupInit>();
  expect_doubt_where_made_again<PublisherInit>();
}

// Two processes of a pid, the first of which was not seen to end.
TextTrace of_one_pid(const std::string& first, const std::string& second) {
  return trace_of("process one pid=100 crash " + first + R"(
    callback a
    10 start a
    12 end a
    40000000 start a
    40000002 end a
    process two pid=100 from=50000000 )" +
                  second + R"(
    callback b id=a
    60000000 start b
    60000002 end b)");
}

// The second one is attached to, and announces itself when it has run a while.
TEST(ReusedPid, IsInDoubtWhereItsProcessHadBegunBeforeTheLastInstancesOfTheFormer) {
  const auto recorded = [](std::int64_t began) {
    auto trace = of_one_pid("until=2000", "attached crash");
    for (auto& event : trace.events) {
      auto* begin = std::get_if<RunBegin>(&event.body);
      if (begin == nullptr) continue;
      begin->process_start_ns = begin->moment == RunMoment::announce ? began : 1;
    }
    return Verified(trace);
  };
  EXPECT_TRUE(is_any_pid_shared(recorded(20'000'000)));
  EXPECT_FALSE(is_any_pid_shared(recorded(45'000'000)));
  EXPECT_FALSE(is_any_pid_shared(recorded(35'000'000))) << "the kernel counts in ticks of 10 ms";
}

// The process goes on as another program, which begins with its run_begin.
TEST(ReusedPid, IsNoneOfAProcessThatExecutesAnotherProgram) {
  const auto recorded = [](RunMoment moment) {
    auto trace = of_one_pid("until=40000010", "");
    for (auto& event : trace.events) {
      auto* begin = std::get_if<RunBegin>(&event.body);
      if (begin == nullptr) continue;
      const bool is_later = event.head.time.ns > 40'000'000;
      begin->process_start_ns = is_later ? 11 : 1;  // each program reads it by two clocks
      if (is_later) begin->moment = moment;
    }
    return Verified(trace);
  };
  const auto after_exec = recorded(RunMoment::start);
  EXPECT_FALSE(is_any_pid_shared(after_exec));
  EXPECT_EQ(after_exec["M2"], Verdict::pass);
  EXPECT_EQ(after_exec["M3"], Verdict::pass);
  EXPECT_TRUE(is_any_pid_shared(recorded(RunMoment::announce)));
}

// A process whose program ends its run, and a later run of the same pid, which says that the process began
// `later_start` after the first one said it did. Both have a timer of the same name.
TextTrace of_two_runs(std::int64_t later_start, const std::string& first = "until=500",
                      const std::string& more = "") {
  auto trace = trace_of("process one pid=100 " + first + R"(
    callback a id=/n@Timer timer period=1000 deadline=500
    10 start a release=10
    30 end a
    process two pid=100 from=2000
    callback b id=/n@Timer timer period=1000 deadline=10
    3000 start b release=3000
    3020 end b
    4000 start b release=4000
    4020 end b)" + more);
  for (auto& event : trace.events) {
    auto* begin = std::get_if<RunBegin>(&event.body);
    if (begin != nullptr)
      begin->process_start_ns = event.head.time.ns < 1'000 ? 1 : 1 + later_start;
  }
  return trace;
}

// A clock tells the start to tens of nanoseconds: by chance both programs read the same.
TEST(ReusedPid, IsNoneOfAProgramThatExecutesAnotherOneWhateverStartsItTells) {
  for (const auto* first : {"until=500", "until=500 crash"}) {
    const Verified known(of_two_runs(40, first));
    const Verified by_chance(of_two_runs(0, first));
    EXPECT_EQ(by_chance["R3"], Verdict::fail) << first;
    EXPECT_EQ(by_chance["M5"], Verdict::fail) << first;
    EXPECT_FALSE(is_any_pid_shared(by_chance)) << first;
    EXPECT_EQ(by_chance.result.report.processes.size(), 2U) << first;
    for (const auto& rule : known.result.verdicts.rules)
      EXPECT_EQ(by_chance[rule.id], rule.verdict) << first << ' ' << rule.id;
  }
}

// The tracer's library tells a program's name before the program begins its run, or when a session
// attaches: `delay` after that.
std::vector<std::string> names_of(TextTrace trace, const std::vector<std::string>& told,
                                  std::int64_t delay = -1) {
  std::vector<Event> names;
  for (const auto& event : trace.events) {
    if (!std::holds_alternative<RunBegin>(event.body)) continue;
    auto& name = names.emplace_back(event);
    name.head.time.ns += names.size() == 1 ? delay : -1;
    name.body = ProcessName{.name = told[names.size() - 1]};
  }
  trace.events.insert(trace.events.end(), names.begin(), names.end());
  std::ranges::stable_sort(trace.events, {}, [](const Event& event) { return event.head.time; });
  std::vector<std::string> seen;
  for (const auto& process : analyze(trace).report.processes)
    seen.push_back(process.name);
  return seen;
}

TEST(ReusedPid, HasTheNameOfEachProgram) {
  for (const std::int64_t later_start : {40, 0, 50'000'000}) {
    for (const auto* first : {"until=500", "until=500 crash"}) {
      const auto trace = of_two_runs(later_start, first);
      for (const std::string second : {"second", "first"}) {
        const std::vector<std::string> told{"first", second};
        EXPECT_EQ(names_of(trace, told), told) << later_start << ' ' << first;
      }
    }
  }
}

// A verdict on the one is told from that on the other, and so are their rows.
TEST(ReusedPid, TellsSubjectsOfItsProgramsApart) {
  for (const auto* more : {"", "process three pid=200\ncallback c\n3000 start c\n3020 end c"}) {
    const Verified verified(of_two_runs(40, "until=500", std::string("\n") + more));
    EXPECT_EQ(verified.of("R3", "callback /n@Timer (pid 100, program 1)"), Verdict::pass);
    EXPECT_EQ(verified.of("R3", "callback /n@Timer (pid 100, program 2)"), Verdict::fail);
    std::vector<std::uint32_t> programs;
    for (const auto& process : verified.result.report.processes)
      programs.push_back(process.program);
    programs.resize(2);
    EXPECT_EQ(programs, (std::vector<std::uint32_t>{1, 2}));
  }
}

TEST(ReusedPid, HasTheNameOfEachProgramWhereASessionAttachedToTheFirst) {
  for (const std::string second : {"second", "first"}) {
    const std::vector<std::string> told{"first", second};
    EXPECT_EQ(names_of(of_two_runs(40, "until=500 attached"), told, 1), told);
  }
}

TEST(ReusedPid, IsNoneOfAProgramThatExecutesAnotherOneWhereItsEndIsLost) {
  const Verified lossy(of_two_runs(0, "until=500 crash", "\n510 discard user until=520 count=1"));
  EXPECT_EQ(lossy["R3"], Verdict::fail);
  EXPECT_FALSE(is_any_pid_shared(lossy));
}

// It was attached to, and nothing of the former one is in the recording: it is as any other process.
TEST(ReusedPid, OfAProgramThatWasExecutedBeforeTheRecordingIsAsOfOneThatNeverWas) {
  const auto recorded = [](std::int64_t process_start) {
    auto trace = of_two_runs(0);
    std::erase_if(trace.events, [](const Event& event) {
      return event.head.time.ns < 1'000 && category_of(event.body) != EventCategory::structure;
    });
    for (auto& event : trace.events) {
      auto* begin = std::get_if<RunBegin>(&event.body);
      if (begin == nullptr) continue;
      begin->moment = RunMoment::announce;
      begin->process_start_ns = process_start;
    }
    return Verified(trace);
  };
  const auto executed = recorded(1);
  EXPECT_EQ(executed["T4"], Verdict::pass);
  EXPECT_EQ(executed["M5"], Verdict::not_applicable);
  EXPECT_EQ(executed["R3"], Verdict::fail);
  EXPECT_FALSE(is_any_pid_shared(executed));
  const auto begun = recorded(1'990);
  for (const auto& rule : begun.result.verdicts.rules)
    EXPECT_EQ(executed[rule.id], rule.verdict) << rule.id;
}

// What the kernel saw of the main thread since then is the other program's.
TEST(ReusedPid, IsOfTheOtherProgramFromItsRunBeginOn) {
  auto trace = of_two_runs(0, "until=500", R"(
    2001 switch 0 idle b prio=120 next_prio=120
    2002 switch 0 b idle state=1)");
  constexpr std::int64_t kMain = 100;
  for (auto& event : trace.events) {
    auto* run = std::get_if<SchedSwitch>(&event.body);
    if (run != nullptr && run->next_tid != 0) run->next_tid = kMain;
    if (run != nullptr && run->prev_tid != 0) run->prev_tid = kMain;
  }
  EXPECT_EQ(Verified(trace)["M5"], Verdict::fail);
}

// Numbers what a second run of the process has after what the first one had.
void go_on_with_ids(TextTrace& trace) {
  const auto later = [](auto id) { return decltype(id){to_number(id) + 1}; };
  for (auto& event : trace.events) {
    if (event.head.time.ns < 1'000) continue;
    std::visit(Overloaded{[&](NodeInit& e) { e.node = later(e.node); },
                          [&](GroupInit& e) {
                            e.node = later(e.node);
                            e.group = later(e.group);
                          },
                          [&](CallbackInit& e) {
                            e.callback = later(e.callback);
                            e.node = later(e.node);
                            e.group = later(e.group);
                          },
                          [&](ThreadInit& e) {
                            e.callback = later(e.callback);
                            e.group = later(e.group);
                          },
                          [&](CallbackStart& e) { e.callback = later(e.callback); },
                          [&](CallbackEnd& e) { e.callback = later(e.callback); },
                          [&](CallbackFini& e) { e.callback = later(e.callback); },
                          [&](RunEnd& e) { e = {.callbacks = 2, .threads = 2, .groups = 2}; },
                          [](const auto&) {}},
               event.body);
  }
}

TEST(ReusedPid, IsThatOfOneProcessWhichRunsAgain) {
  auto trace = of_two_runs(0);
  go_on_with_ids(trace);
  const Verified verified(trace);
  EXPECT_EQ(verified.result.report.processes.size(), 1U);
  EXPECT_EQ(verified["T4"], Verdict::pass) << verified.evidence("T4", "process 100");
  EXPECT_EQ(verified["M5"], Verdict::fail) << "its deadline";
  EXPECT_FALSE(is_any_pid_shared(verified));
}

TEST(ReusedPid, IsThatOfOneProcessOfWhichTwoSessionsTell) {
  auto trace = of_two_runs(0);
  const auto begin = std::ranges::find_if(trace.events, [](const Event& event) {
    return event.head.time.ns == 2'000 && std::holds_alternative<RunBegin>(event.body);
  });
  ASSERT_NE(begin, trace.events.end());
  trace.events.insert(begin, Event(*begin));
  EXPECT_EQ(Verified(trace).result.report.processes.size(), 2U);
}

// Whoever attaches is told what runs. No process tells of one callback in two ways.
TEST(ReusedPid, IsInDoubtWhereACallbackIsAnnouncedWithAnotherDeadline) {
  const auto announced = [](std::uint64_t deadline) {
    auto trace = of_two_runs(0, "until=500 crash");
    for (auto& event : trace.events) {
      if (event.head.time.ns < 1'000) continue;
      if (auto* begin = std::get_if<RunBegin>(&event.body)) begin->moment = RunMoment::announce;
      if (auto* init = std::get_if<CallbackInit>(&event.body)) {
        init->deadline_ns = deadline;
        init->next_seq = 1;
      }
      if (auto* start = std::get_if<CallbackStart>(&event.body)) ++start->seq;
      if (auto* end = std::get_if<CallbackEnd>(&event.body)) ++end->seq;
    }
    return Verified(trace);
  };
  EXPECT_TRUE(is_any_pid_shared(announced(10)));
  EXPECT_FALSE(is_any_pid_shared(announced(500)));
}

TEST(ReusedPid, IsNoneOfAProcessWhoseCallbacksRunWhenItEnds) {
  const std::string ends_first = R"(
    process one until=500
    callback a
    10 start a
    12 end a
    490 start a
    600 end a
    610 start a
    612 end a)";
  const Verified whole(ends_first);
  EXPECT_FALSE(is_any_pid_shared(whole));
  EXPECT_EQ(whole.result.report.callbacks.at(0).instances, 3U);
  const auto lossy = ends_first + "\n580 discard user until=590 count=1";
  EXPECT_TRUE(is_any_pid_shared(Verified(lossy)));
  EXPECT_FALSE(is_any_pid_shared(Verified(lossy + "\n700 reload"))) << "it has the pid still";
}

}  // namespace
}  // namespace cie::test
