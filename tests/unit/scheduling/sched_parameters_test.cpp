#include "scheduling/sched_parameters.hpp"

#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

trace::SchedReadBack reported(Policy policy) {
  trace::SchedReadBack read_back;
  read_back.policy = static_cast<std::int32_t>(policy);
  read_back.cpus = {0, 1};
  return read_back;
}

SchedRequest ask(const ThreadParameters& asked) {
  const KernelView kernel;
  ExclusiveCpusets cpusets{kernel};
  KernelCalls calls;
  return request(calls, 0, asked, cpusets);
}

TEST(Differences, AreNoneWhenNothingIsAsked) {
  EXPECT_THAT(differences({}, reported(Policy::fifo)), IsEmpty());
}

TEST(Differences, NameWhatIsOtherwise) {
  ThreadParameters asked;
  asked.policy = Policy::fifo;
  asked.priority = 80;
  asked.cpus = {{1}};
  EXPECT_THAT(differences(asked, reported(Policy::other)),
              ElementsAre("policy is SCHED_OTHER instead of SCHED_FIFO",
                          "priority is 0 instead of 80", "affinity is 0,1 instead of 1"));
}

// A FIFO thread has a nice value too, but nobody asked for it.
TEST(Differences, LookOnlyAtWhatThePolicyHas) {
  ThreadParameters asked;
  asked.policy = Policy::fifo;
  asked.priority = 5;
  auto read_back = reported(Policy::fifo);
  read_back.priority = 5;
  read_back.nice = -3;
  read_back.runtime_ns = 77;
  EXPECT_THAT(differences(asked, read_back), IsEmpty());
}

TEST(Differences, CompareTheWholeDeadlineTriple) {
  ThreadParameters asked;
  asked.policy = Policy::deadline;
  asked.runtime_ns = 1;
  asked.deadline_ns = 2;
  asked.period_ns = 3;
  auto read_back = reported(Policy::deadline);
  read_back.runtime_ns = 1;
  read_back.deadline_ns = 20;
  read_back.period_ns = 30;
  EXPECT_THAT(differences(asked, read_back),
              ElementsAre("deadline is 20 instead of 2", "period is 30 instead of 3"));
}

TEST(Differences, NameAPolicyThatHasNoName) {
  ThreadParameters asked;
  asked.policy = Policy::other;
  EXPECT_THAT(differences(asked, reported(Policy{7})),
              ElementsAre("policy is 7 instead of SCHED_OTHER"));
}

TEST(Differences, CompareTheSliceIfOneIsAsked) {
  ThreadParameters asked;
  asked.policy = Policy::other;
  auto read_back = reported(Policy::other);
  read_back.slice_ns = 2'800'000;
  EXPECT_THAT(differences(asked, read_back), IsEmpty());
  asked.slice_ns = 100'000;
  EXPECT_THAT(differences(asked, read_back), ElementsAre("slice is 2800000 instead of 100000"));
  read_back.slice_ns = 0;
  EXPECT_THAT(differences(asked, read_back),
              ElementsAre("slice is 0 instead of 100000 (it needs Linux 6.12)"));
}

// Needs no privilege. Other threads and later tests keep theirs.
TEST(Request, OfASliceIsReadBack) {
  std::thread{[] {
    if (trace::read_back(0)->slice_ns == 0)
      GTEST_SKIP() << "not possible here: this kernel has no time slices";
    ThreadParameters asked;
    asked.policy = Policy::other;
    asked.slice_ns = 300'000;
    EXPECT_EQ(ask(asked).error, 0);
    EXPECT_EQ(trace::read_back(0)->slice_ns, 300'000U);
  }}.join();
}

TEST(Request, OfClampsIsReadBackOrRefusedByName) {
  std::thread{[] {
    ThreadParameters asked;
    asked.policy = Policy::other;
    asked.util_max = 500;
    const SchedRequest outcome = ask(asked);
    const auto reported = *trace::read_back(0);
    if (outcome.error == 0) {
      EXPECT_EQ(reported.util_max, 500U);
    } else {
      EXPECT_EQ(reported.util_max, 0U) << "this kernel has clamps";
      EXPECT_THAT(outcome.what, testing::HasSubstr("uclamp_max 500"));
      EXPECT_THAT(outcome.reason, testing::HasSubstr("CONFIG_UCLAMP_TASK"));
    }
  }}.join();
}

// A SCHED_DEADLINE thread cannot be given CPUs; one that leaves that policy can, afterwards.
TEST(Request, TakesAThreadOutOfDeadlineBeforeItsCpus) {
  std::thread{[] {
    ThreadParameters deadline;
    deadline.policy = Policy::deadline;
    deadline.runtime_ns = 100'000;
    deadline.deadline_ns = deadline.period_ns = 100'000'000;
    const auto all = trace::read_back(0)->cpus;
    const SchedRequest first = ask(deadline);
    if (first.error != 0) GTEST_SKIP() << "not possible here: " << first.reason;
    deadline.cpus = all;
    EXPECT_EQ(ask(deadline).error, 0) << "all CPUs are what it has";
    ThreadParameters batch;
    batch.policy = Policy::batch;
    batch.cpus = {{all.back()}};
    EXPECT_EQ(ask(batch).error, 0);
    EXPECT_THAT(differences(batch, *trace::read_back(0)), IsEmpty());
  }}.join();
}

TEST(Request, OfACpuThatIsNotThereIsRefusedInWords) {
  ThreadParameters asked;
  asked.cpus = {{1023}};
  const SchedRequest outcome = ask(asked);
  EXPECT_EQ(outcome.error, EINVAL);
  EXPECT_EQ(outcome.what, "CPUs 1023");
  EXPECT_THAT(outcome.reason, testing::HasSubstr("online"));
}

}  // namespace
}  // namespace cie::scheduling
