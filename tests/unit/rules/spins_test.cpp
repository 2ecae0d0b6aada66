// A thread that spins again is announced again, and its read-backs are numbered from 0 anew. What is
// lost between two spins may make one series of theirs, from which nothing follows (law L2).
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

// Everything that applications told of threads from `from` to `to`.
TextTrace without_state(TextTrace trace, std::int64_t from, std::int64_t to) {
  std::erase_if(trace.events, [from, to](const Event& event) {
    const bool is_state = std::holds_alternative<ThreadInit>(event.body) ||
                          std::holds_alternative<ThreadSched>(event.body) ||
                          std::holds_alternative<ThreadFini>(event.body);
    return is_state && event.head.time.ns >= from && event.head.time.ns <= to;
  });
  return trace;
}

// The second spin has other parameters, which are `last` in the end.
std::string spun_twice(const std::string& process, const std::string& last) {
  return "process app " + process + R"(
    callback fusion
    -100 begin fusion
    -90 initial fusion n=0 cpus=0
    -80 applied fusion n=1 policy=fifo priority=30 cpus=0
    10 start fusion
    12 end fusion
    30 finish fusion
    35 init fusion
    40 begin fusion again
    41 initial fusion n=0 policy=fifo priority=30 cpus=0
    42 applied fusion n=1 policy=fifo priority=50 cpus=0,1
    50 start fusion cpu=1
    52 end fusion cpu=1
    60 audit fusion n=2 policy=fifo )" +
         last + "\n70 finish fusion\n";
}

constexpr const char* kLostState = "29 discard user until=43 count=5\n";

TEST(Spins, ThatReadAsOneViolateNothing) {
  for (const auto* process : {"", "crash"}) {
    const auto text = spun_twice(process, "priority=50 cpus=0,1");
    for (const auto* rule : {"S3", "S4"})
      ASSERT_EQ(Verified(text)[rule], Verdict::pass) << rule << process;
    const Verified lossy(without_state(trace_of(text + kLostState), 30, 42));
    for (const auto* rule : {"S3", "S4"})
      EXPECT_EQ(lossy[rule], Verdict::inconclusive) << rule << process;
  }
}

TEST(Spins, ThatReadAsOnePassNothing) {
  for (const auto* process : {"", "crash"}) {
    const auto text = spun_twice(process, "priority=30 cpus=0,1");
    ASSERT_EQ(Verified(text)["S3"], Verdict::fail) << process;
    const Verified lossy(without_state(trace_of(text + kLostState), 30, 42));
    EXPECT_EQ(lossy["S3"], Verdict::inconclusive) << process;
  }
}

// The thread of fusion is announced anew for plan, which it runs then.
std::string handed_over(const std::string& first, const std::string& second,
                        const std::string& more = {}) {
  return R"(
    callback fusion
    callback plan
    -100 begin fusion
    -90 initial fusion n=0 cpus=0
    -80 applied fusion n=1 cpus=0 )" +
         first + R"(
    10 start fusion
    12 end fusion
    30 finish fusion
    40 begin fusion again for=plan
    41 initial fusion n=0 cpus=0
    42 applied fusion n=1 cpus=0 )" +
         second + R"(
    50 start plan on=fusion
    52 end plan on=fusion
    )" + more +
         "\n    70 finish fusion\n";
}

constexpr const char* kFifo = "policy=fifo priority=50";
constexpr const char* kOther = "policy=other";
constexpr const char* kFusionIsFifo =
    "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 50}\n";

TEST(Spins, OfAnotherCallbackDoNotMakeTheFormersStartsForeign) {
  EXPECT_EQ(Verified(handed_over(kFifo, kOther)).of("M6", "thread 101"), Verdict::pass);
  const Verified early(
      handed_over(kFifo, kOther, "20 start plan on=fusion\n22 end plan on=fusion"));
  EXPECT_EQ(early.of("M6", "thread 101"), Verdict::fail);
  EXPECT_THAT(early.evidence("M6", "thread 101"),
              AllOf(HasSubstr("-100 thread_init announced for callback 0"),
                    HasSubstr("20 callback_start started plan (seq 0), which is not its own")));
  const Verified late(
      handed_over(kFifo, kOther, "60 start fusion on=fusion\n62 end fusion on=fusion"));
  EXPECT_EQ(late.of("M6", "thread 101"), Verdict::fail);
  EXPECT_THAT(late.evidence("M6", "thread 101"),
              AllOf(HasSubstr("40 thread_init announced for callback 1"),
                    HasSubstr("60 callback_start started fusion (seq 1), which is not its own")));
}

// Nothing tells for whom the thread was announced before: the first announcement is lost, or from before
// the recording.
TEST(Spins, OfAnotherCallbackTellNothingOfStartsBeforeTheFirstAnnouncementThatWasSeen) {
  const auto without_first = [](const std::string& text) {
    auto trace = trace_of("process app crash" + text);
    trace.erase<ThreadInit>(
        [](const ThreadInit&, const EventHead& head) { return head.time.ns == -100; });
    return Verified(trace);
  };
  EXPECT_EQ(without_first(handed_over(kFifo, kOther)).of("M6", "thread 101"),
            Verdict::inconclusive);
  const auto later = without_first(
      handed_over(kFifo, kOther, "60 start fusion on=fusion\n62 end fusion on=fusion"));
  EXPECT_EQ(later.of("M6", "thread 101"), Verdict::fail);
  EXPECT_THAT(later.evidence("M6", "thread 101"),
              HasSubstr("60 callback_start started fusion (seq 1), which is not its own"));
}

// The thread is announced for three callbacks in turn, the last time unseen.
TEST(Spins, WhoseAnnouncementMayBeLostAreNotForeignToTheOneBefore) {
  const auto judged = [](const std::string& more) {
    auto trace = trace_of(R"(
      process app crash
      callback fusion
      callback plan
      callback lidar
      -100 begin fusion
      10 start fusion
      12 end fusion
      30 finish fusion
      40 begin fusion again for=plan
      50 start plan on=fusion
      52 end plan on=fusion
      60 finish fusion
      70 begin fusion again for=lidar
      80 start lidar on=fusion
      82 end lidar on=fusion
      )" + more);
    trace.erase<ThreadFini>(
        [](const ThreadFini&, const EventHead& head) { return head.time.ns == 60; });
    trace.erase<ThreadInit>(
        [](const ThreadInit&, const EventHead& head) { return head.time.ns == 70; });
    return Verified(trace).of("M6", "thread 101");
  };
  EXPECT_EQ(judged(""), Verdict::fail);
  EXPECT_EQ(judged("55 discard user until=75 count=2"), Verdict::inconclusive);
  EXPECT_EQ(judged("90 discard user until=95 count=2"), Verdict::fail) << "lost since";
  EXPECT_EQ(judged("45 discard user until=48 count=2"), Verdict::fail) << "its own ran since";
}

TEST(Spins, OfAnotherCallbackAreNotTheFormersParameters) {
  const auto judged = [](const char* first, const char* second, const char* rule) {
    return Verified(handed_over(first, second), kFusionIsFifo).of(rule, "callback fusion");
  };
  EXPECT_EQ(judged(kFifo, kOther, "S1"), Verdict::pass);
  EXPECT_EQ(judged(kFifo, kOther, "S2"), Verdict::pass);
  EXPECT_EQ(judged(kOther, kFifo, "S1"), Verdict::fail);
  EXPECT_EQ(judged(kOther, kFifo, "S2"), Verdict::not_applicable) << "none that match were applied";
}

// run_end counts announcements, of which a thread that spins twice has two.
TEST(Spins, OfOneThreadMakeNoAnnouncementOfAnotherMissing) {
  const Verified verified(spun_twice("", "priority=50 cpus=0,1") + R"(
    callback lidar
    callback plan pooled
    14 start lidar
    16 end lidar
    18 start plan on=lidar
    20 end plan on=lidar
    22 finish lidar)");
  EXPECT_EQ(verified.of("M2", "thread 102"), Verdict::fail);
}

// What run_end counts is what was seen: no announcement is missing, whatever else is.
TEST(Spins, ThatAreAllSeenAreJudgedThoughEventsWereLost) {
  const Verified lossy(spun_twice("", "priority=30 cpus=0,1") + kLostState);
  EXPECT_EQ(lossy["S3"], Verdict::fail);
  EXPECT_EQ(lossy["S4"], Verdict::pass);
}

// Its announcement is the one that is missing, and known to be: that of another thread is not.
TEST(Spins, OfAnotherThreadThanTheOneThatWasNotAnnouncedAreAllSeen) {
  auto trace = trace_of(spun_twice("", "priority=50 cpus=0,1") + R"(
    callback plan
    -20 begin plan
    -19 initial plan
    -18 applied plan policy=fifo priority=20
    -21 discard user until=-20 count=1)");
  trace.erase<ThreadInit>([](const ThreadInit& e, const EventHead&) { return e.name == "plan"; });
  const Verified lossy(trace);
  EXPECT_EQ(lossy.of("S3", "thread 101"), Verdict::pass);
  EXPECT_EQ(lossy.of("S3", "thread 102"), Verdict::inconclusive);
}

// The first `applied` of two is lost: by its number the one of the second spin is the first.
TEST(Spins, DoNotShowAThreadUnconfiguredWhereTheFirstLostItsParameters) {
  constexpr auto kSpec = "callback_groups:\n  - {id: fusion, policy: SCHED_FIFO, priority: 30}\n";
  auto trace = trace_of(R"(
    callback fusion
    -100 begin fusion
    -90 initial fusion n=0
    -80 applied fusion n=1 policy=fifo priority=30
    10 start fusion
    12 end fusion
    30 finish fusion
    35 init fusion
    40 begin fusion again
    41 initial fusion n=0
    42 applied fusion n=1 policy=fifo priority=30
    50 start fusion
    52 end fusion
    60 finish fusion)");
  ASSERT_EQ(Verified(trace, kSpec)["S2"], Verdict::pass);
  trace.erase<ThreadSched>(
      [](const ThreadSched&, const EventHead& head) { return head.time.ns == -80; });
  EXPECT_EQ(Verified(trace, kSpec)["S2"], Verdict::inconclusive);
}

// What a spin begins with was left by the one before, and inherited from nobody.
TEST(Spins, BeginWithWhatTheOneBeforeLeft) {
  const auto text = spun_twice("", "priority=50 cpus=0,1");
  ASSERT_EQ(Verified(text)["S5"], Verdict::pass);
  EXPECT_EQ(Verified(without_state(trace_of(text), -90, -90))["S5"], Verdict::inconclusive)
      << "what the first one began with";
  EXPECT_EQ(Verified(without_state(trace_of(text), -100, -90))["S5"], Verdict::inconclusive)
      << "and its announcement";
  const auto loss = text + "-101 discard user until=31 count=5\n";
  EXPECT_EQ(Verified(without_state(trace_of(loss), -100, 30))["S5"], Verdict::inconclusive)
      << "all of it";
}

// A thread says when it was announced first: before the recording.
TEST(Spins, BeforeAnAttachShowThatAThreadDoesNotBegin) {
  auto trace = trace_of(R"(
    process app attached
    callback fusion next=3
    5 begin fusion
    6 initial fusion n=0 policy=fifo priority=30
    7 applied fusion n=1 policy=fifo priority=30
    10 start fusion
    12 end fusion)");
  ASSERT_EQ(Verified(trace)["S5"], Verdict::fail);
  for (auto& event : trace.events)
    if (auto* init = std::get_if<ThreadInit>(&event.body)) init->start_ns = -1'000'000'000;
  EXPECT_EQ(Verified(trace)["S5"], Verdict::not_applicable);
}

}  // namespace
}  // namespace cie::test
