// Two processes with one pid, at once or one after the other: containers, or one that is started again.
#include "ros2_text.hpp"

#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using analysis::Verdict;
using testing::ElementsAre;
using testing::HasSubstr;

std::string at(std::int64_t time, const std::string& event) {
  return "  " + std::to_string(time) + ' ' + event + '\n';
}

// A process with a timer of period 1000, at addresses that no other base has.
std::string begin(std::int64_t time, const std::string& node, int base, int tid = 1) {
  const auto address = [base](int place) { return std::to_string(base + place); };
  const auto thread = " tid=" + std::to_string(tid) + ' ';
  return at(time, "rcl_init" + thread + "context_handle=" + address(0x1)) +
         at(time, "rcl_node_init" + thread + "node_handle=" + address(0x10) +
                      " namespace=/ node_name=" + node) +
         at(time, "rcl_timer_init" + thread + "period=1000 timer_handle=" + address(0x20)) +
         at(time, "rclcpp_timer_callback_added" + thread + "timer_handle=" + address(0x20) +
                      " callback=" + address(0x30)) +
         at(time, "rclcpp_timer_link_node" + thread + "timer_handle=" + address(0x20) +
                      " node_handle=" + address(0x10));
}

std::string start(std::int64_t time, int base, int cpu = 0) {
  return at(time, "callback_start cpu=" + std::to_string(cpu) +
                      " callback=" + std::to_string(base + 0x30));
}

std::string end(std::int64_t time, int base, int cpu = 0) {
  return at(time,
            "callback_end cpu=" + std::to_string(cpu) + " callback=" + std::to_string(base + 0x30));
}

std::string ran(std::int64_t begins, std::int64_t ends, int base) {
  return start(begins, base) + end(ends, base);
}

constexpr int kFirst = 0x1000;
constexpr int kSecond = 0x2000;
constexpr const char* kDeadlineOfA =
    "callback_groups:\n  - {id: \"/a@Timer(1000)\", response_deadline: 500, wcet: 500}\n";

// It keeps the deadline in its first life, and not in the second.
std::string two_lives(const std::string& between = {}) {
  return begin(0, "a", kFirst) + ran(1000, 1100, kFirst) + ran(2000, 2100, kFirst) + between +
         begin(5000, "a", kSecond) + ran(6000, 6900, kSecond) + ran(7000, 7900, kSecond);
}

TEST(Ros2SharedPids, WhichEntryIsThatOfANumberedIdIsUnknownAfterAnotherBegin) {
  const auto result = analyze_ros2(two_lives(), -1, kDeadlineOfA);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/a@Timer(1000)", "/a@Timer(1000)#2"));
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R4"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("R3"), HasSubstr("another rcl_init of this pid"));
}

TEST(Ros2SharedPids, ANumberedIdOfTheFirstBeginHasNoEntryOfAnother) {
  auto second = begin(1, "a", kSecond);
  second.erase(0, second.find('\n') + 1);  // without its rcl_init
  const auto result = analyze_ros2(
      begin(0, "a", kFirst) + second + ran(1000, 1100, kFirst) + ran(6000, 6900, kSecond), -1,
      kDeadlineOfA);
  EXPECT_EQ(result.verdict("R4"), Verdict::pass) << result.evidence("R4");
}

TEST(Ros2SharedPids, AnotherNodeOfASecondContextHasItsOwnEntry) {
  const auto result = analyze_ros2(begin(0, "b", kFirst) + ran(1000, 1100, kFirst) +
                                       begin(5000, "a", kSecond) + ran(6000, 6900, kSecond),
                                   -1, kDeadlineOfA);
  EXPECT_EQ(result.verdict("R3"), Verdict::fail) << result.evidence("R3");
}

TEST(Ros2SharedPids, CallbacksOfTwoBeginsAreNoTwoOnOneThread) {
  const auto result = analyze_ros2(two_lives());
  EXPECT_EQ(result.verdict("M2"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("M2"), HasSubstr("another process may have that"));
  EXPECT_FALSE(result.callback("/a@Timer(1000)").isolation) << "neither isolated nor not";
  const auto both = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    11 callback_end callback=0x30
    12 callback_start callback=0x31
    13 callback_end callback=0x31)" +
                                 '\n' + begin(5000, "a", kSecond) + ran(6000, 6900, kSecond));
  EXPECT_EQ(both.verdict("M2"), Verdict::fail) << "two of the first begin";
}

// They may be on two CPUs, of which the outer one's thread was moved there.
TEST(Ros2SharedPids, ARunInsideOneOfAnotherBeginIsNoNesting) {
  const auto inside = [](const std::string& second) {
    return analyze_ros2(begin(0, "a", kFirst) + second + start(6000, kFirst) +
                        start(6010, kSecond, 1) + end(6020, kSecond, 1) + end(6030, kFirst));
  };
  const auto result = inside(begin(10, "b", kSecond));
  EXPECT_EQ(result.verdict("E3"), Verdict::inconclusive);
  auto same = begin(10, "b", kSecond);
  same.erase(0, same.find('\n') + 1);  // without its rcl_init
  EXPECT_EQ(inside(same).verdict("E3"), Verdict::fail);
}

TEST(Ros2SharedPids, RunsAcrossEachOtherAreOfTwoThreads) {
  const auto both = begin(0, "a", kFirst) + begin(10, "b", kSecond);
  for (const bool is_begin_seen : {true, false}) {
    auto text = both;
    if (!is_begin_seen) text.clear();  // both began before the recording
    const auto result = analyze_ros2(text + start(1002, kFirst) + start(1012, kSecond, 1) +
                                     end(1020, kFirst) + end(1030, kSecond, 1));
    for (const auto* rule : {"M2", "M3", "E1", "E2", "E3"})
      EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(result.evidence("M2"), HasSubstr("overlap and do not nest"));
  }
}

// The tracer gives the context procname anew at each event, and a thread has one name there.
TEST(Ros2SharedPids, AThreadOfAnotherNameInsideARunIsAnother) {
  const auto inside = [](const std::string& name) {
    return analyze_ros2(std::string(kTwoTimers) + R"(
      10 callback_start callback=0x30 procname=one
      12 callback_start callback=0x31 procname=)" +
                        name + R"(
      14 callback_end callback=0x31
      20 callback_end callback=0x30)");
  };
  EXPECT_EQ(inside("one").durations(), "/n@Timer(1): 1 of 10 to 10\n/n@Timer(2): 1 of 2 to 2\n");
  const auto result = inside("two");
  for (const auto* rule : {"M2", "M3", "E1", "E2", "E3"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
  for (const auto& callback : result.analysis.report.callbacks)
    EXPECT_FALSE(callback.duration) << callback.logical_id;
}

// Both are of one image, and addresses are not randomized.
TEST(Ros2SharedPids, ARunInsideItselfAtAnAddressOfTwoBeginsIsOfTheOther) {
  const auto runs =
      start(1000, kFirst) + start(1010, kFirst, 1) + end(1020, kFirst) + end(1030, kFirst, 1);
  const auto shared = analyze_ros2(begin(0, "a", kFirst) + begin(10, "b", kFirst) + runs);
  EXPECT_THAT(shared.evidence("M2"), HasSubstr("two processes have this pid"));
  for (const auto& callback : shared.analysis.report.callbacks) {
    EXPECT_FALSE(callback.duration) << callback.logical_id;
    EXPECT_FALSE(callback.isolation) << callback.logical_id;
  }
  const auto alone = analyze_ros2(begin(0, "a", kFirst) + runs);
  EXPECT_EQ(alone.callback("/a@Timer(1000)").duration->max, 30) << "of a reentrant group, perhaps";
}

// An exception leaves the inner run, and what it is of runs again.
TEST(Ros2SharedPids, ARunThatIsLeftLiesAcrossNone) {
  const auto result = analyze_ros2(std::string(kTwoTimers) + R"(
    10 callback_start callback=0x30
    11 callback_start callback=0x31
    15 callback_end callback=0x30
    20 callback_start callback=0x31
    21 callback_end callback=0x31)");
  EXPECT_EQ(result.verdict("M2"), Verdict::fail) << result.evidence("M2");
}

// The kernel tells that the main thread exits, and that a thread with its tid is made.
TEST(Ros2SharedPids, AnExitIsNotThatOfTheNextProcess) {
  const auto switched_in = [](std::int64_t time) {
    return at(time,
              "sched:sched_switch cpu=0 prev_tid=0 prev_prio=120 prev_state=0 next_tid=1 "
              "next_prio=120");
  };
  const auto exit = [](std::int64_t time) {
    return at(time, "sched:sched_process_exit tid=1 pid=1") +
           at(time + 1,
              "sched:sched_switch cpu=0 prev_tid=1 prev_prio=120 prev_state=16 next_tid=0 "
              "next_prio=120");
  };
  const auto given_anew =
      switched_in(2500) + exit(3000) +
      at(4000, "sched:sched_process_fork parent_tid=9 parent_pid=9 child_tid=1 child_pid=1") +
      switched_in(4500);
  const auto has_exited = testing::HasSubstr("its main thread exited");
  EXPECT_THAT(analyze_ros2(two_lives(given_anew)).evidence("T4"), testing::Not(has_exited));
  EXPECT_THAT(analyze_ros2(two_lives(given_anew) + exit(9000)).evidence("T4"), has_exited);
}

// Of two containers from one image, as where the kernel does not randomize addresses.
TEST(Ros2SharedPids, WhatRunsAtAnAddressThatIsTakenSinceAnotherBeginMayBeOfEither) {
  const auto result =
      analyze_ros2(begin(0, "a", kFirst) + ran(1000, 1100, kFirst) + begin(1500, "b", kFirst) +
                       ran(2000, 2900, kFirst) + ran(3000, 3100, kFirst),
                   -1, kDeadlineOfA);
  EXPECT_THAT(result.logical_ids(), ElementsAre("/a@Timer(1000)", "/b@Timer(1000)"));
  EXPECT_EQ(result.verdict("R3"), Verdict::inconclusive);
  EXPECT_EQ(result.verdict("R4"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("R4"), HasSubstr("may be another callback's"));
}

TEST(Ros2SharedPids, InstancesOfTwoProcessesAtOneAddressAreNotThoseOfOneCallback) {
  const auto on = [](std::int64_t time, const char* event, int tid) {
    return at(time, std::string("callback_") + event + " cpu=" + std::to_string(tid) + " tid=" +
                        std::to_string(tid) + " callback=" + std::to_string(kFirst + 0x30));
  };
  std::string both = begin(0, "a", kFirst) + begin(10, "b", kFirst, 5);
  for (const std::int64_t time : {1000, 2000}) {
    both += on(time, "start", 1) + on(time + 10, "start", 5) + on(time + 20, "end", 1) +
            on(time + 30, "end", 5);
  }
  const auto result = analyze_ros2(both);
  for (const auto* rule : {"M3", "E2"})
    EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule << result.evidence(rule);
}

// This project's process has one timer, which ran once.
constexpr const char* kOwn = R"(
  2 cie:run_begin contract_version=1 executor=isolated pid=1 host=h boot_id=b moment=start
  2 cie:node_init node_id=0 name=/n
  2 cie:group_init group_id=0 node_id=0 type=mutually_exclusive
  2 cie:callback_init callback_id=0 node_id=0 group_id=0 kind=timer logical_id=/n@Timer(7) period_ns=7 next_seq=0
  3 cie:thread_init tid=2 role=callback callback_id=0 group_id=0 name=n start_ns=3
  9 cie:callback_start tid=2 callback_id=0 seq=0 release_kind=timer release_ns=9
)";
constexpr const char* kOwnRan = "  11 cie:callback_end tid=2 callback_id=0 seq=0 status=ok\n";
std::string own_end(int time) {
  return at(time, "cie:thread_fini tid=2 read_backs=0") +
         at(time,
            "cie:callback_fini callback_id=0 started=1 ended=1 released=0 overwritten=0 lost=0") +
         at(time, "cie:run_end callbacks=1 threads=1 groups=1 publishers=0 status=0");
}

TEST(Ros2SharedPids, ARunOfRos2AloneSinceAnotherBeginIsOfAnotherProcessThanAnOwnOne) {
  const auto plain = begin(100, "a", kSecond) + ran(1100, 2000, kSecond);
  const auto own = std::string(kOwn) + kOwnRan;
  for (const auto& text : {own + own_end(30) + plain, own + plain + own_end(3000)}) {
    const auto result = analyze_ros2(text, -1, kDeadlineOfA);
    for (const auto* rule : {"T4", "M1", "M2", "E1"})
      EXPECT_EQ(result.verdict(rule), Verdict::inconclusive) << rule;
    EXPECT_THAT(result.evidence("M1"), HasSubstr("another rcl_init of this pid"));
  }
}

// As of a second context, whose callbacks this project's executor runs.
TEST(Ros2SharedPids, ARunThatAnOwnOneTellsOfIsOfItsProcess) {
  const auto result = analyze_ros2(
      at(0, "rcl_init context_handle=0x1") + kOwn + at(9, "rcl_init context_handle=0x2") +
      at(10, "callback_start tid=2 callback=0x30") + at(11, "callback_end tid=2 callback=0x30") +
      kOwnRan + own_end(30));
  EXPECT_EQ(result.verdict("T4"), Verdict::pass) << result.evidence("T4");
  EXPECT_EQ(result.verdict("M2"), Verdict::pass) << result.evidence("M2");
}

// This project's process runs at 50 ms, and tells when it began.
std::string own_begun_at(std::int64_t start_ns) {
  return at(50'000'000,
            "cie:run_begin contract_version=1 executor=isolated pid=1 host=h boot_id=b "
            "moment=start process_start_ns=" +
                std::to_string(start_ns)) +
         at(50'000'001, "cie:run_end callbacks=0 threads=0 groups=0 publishers=0 status=0");
}

// ROS 2's events of the pid came more than a tick of 10 ms before the start that run_begin tells.
TEST(Ros2SharedPids, AProcessThatBeganLaterIsAnother) {
  const auto after = [](std::int64_t start_ns) {
    return analyze_ros2(begin(0, "a", kFirst) + ran(1000, 1100, kFirst) + own_begun_at(start_ns));
  };
  EXPECT_EQ(after(9'000'000).analysis.report.processes.size(), 1U);
  EXPECT_EQ(after(11'000'000).analysis.report.processes.size(), 2U);
}

// Neither of them tells its pid namespace.
TEST(Ros2SharedPids, AProcessThatBeganLaterMayRunBesideTheFirst) {
  const auto result =
      analyze_ros2(begin(0, "a", kFirst) + ran(1000, 1100, kFirst) + own_begun_at(11'000'000) +
                       ran(60'000'000, 60'000'900, kFirst),
                   -1, kDeadlineOfA);
  EXPECT_EQ(result.verdict("R4"), Verdict::inconclusive);
  EXPECT_THAT(result.evidence("R4"), HasSubstr("two processes have this pid"));
}

}  // namespace
}  // namespace cie::test
