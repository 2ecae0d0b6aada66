#include "support/verdicts.hpp"
#include "timer_runs.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ArrivalExceedsTurnaround, FailsWhenAnInstanceLastsUntilTheNextRelease) {
  EXPECT_EQ(Verified(kTwoRuns)["R1"], Verdict::pass);
  const Verified verified(R"(
    callback fusion timer period=10
    12 start fusion release=10
    20 end fusion
    22 start fusion release=20
    28 end fusion)");
  EXPECT_EQ(verified.of("R1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R1", "callback fusion"),
              AllOf(HasSubstr("20 callback_end seq 0 ends"), HasSubstr("released at 20")));
}

TEST(ArrivalExceedsTurnaround, ComparesTheShortestArrivalWithTheLongestResponse) {
  // Inter-arrival 10 then 30; the response time of 12 belongs to the last instance.
  const Verified verified(R"(
    callback fusion timer period=10
    12 start fusion release=10
    15 end fusion
    22 start fusion release=20
    25 end fusion
    52 start fusion release=50
    62 end fusion)");
  EXPECT_EQ(verified.of("R1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R1", "callback fusion"),
              AllOf(HasSubstr("62 callback_end longest response time: 12 ns"),
                    HasSubstr("seq 1 was released 10 ns after the one before it")));
}

TEST(ArrivalExceedsTurnaround, NeedsTwoInstancesAndExactReleases) {
  EXPECT_EQ(Verified("callback fusion\n2 start fusion release=1\n3 end fusion")["R1"],
            Verdict::not_applicable);
  EXPECT_EQ(Verified("callback fusion\n2 start fusion\n3 end fusion\n"
                     "12 start fusion\n13 end fusion")["R1"],
            Verdict::inconclusive);
  auto trace = trace_of(kTwoRuns);
  drop_first_instance(trace);
  EXPECT_EQ(Verified(trace)["R1"], Verdict::inconclusive);
}

// Goals and their cancellations, events of QoS may come at any distance.
TEST(ArrivalExceedsTurnaround, JudgesAWaitableWhereTheSpecDeclaresItsArrivals) {
  constexpr const char* kClose = R"(
    callback fusion waitable
    12 start fusion release=10
    20 end fusion
    22 start fusion release=12
    28 end fusion)";
  EXPECT_EQ(Verified(kClose)["R1"], Verdict::not_applicable);
  EXPECT_EQ(Verified(kClose, spec("max_inter_arrival: 10"))["R1"], Verdict::not_applicable);
  EXPECT_EQ(Verified(kClose, spec("min_inter_arrival: 2"))["R1"], Verdict::fail);
  auto unregistered = trace_of(kClose);
  unregistered.erase<CallbackInit>();
  EXPECT_EQ(Verified(unregistered)["R1"], Verdict::inconclusive);
}

// An instance that never ended was released all the same.
TEST(ArrivalExceedsTurnaround, CountsTheReleaseOfAnInstanceThatNeverEnded) {
  constexpr const char* kOne = R"(
    callback fusion timer period=10
    12 start fusion release=10
    25 end fusion)";
  EXPECT_EQ(Verified(kOne)["R1"], Verdict::not_applicable);
  const Verified before_end(std::string(kOne) + "\n26 start fusion release=20");
  EXPECT_EQ(before_end["R1"], Verdict::fail);
  EXPECT_THAT(before_end.evidence("R1", "callback fusion"),
              AllOf(HasSubstr("25 callback_end seq 0 ends"), HasSubstr("released at 20")));
  EXPECT_EQ(Verified(std::string(kOne) + "\n32 start fusion release=30")["R1"],
            Verdict::not_applicable)
      << "of one instance alone the response time is known";
  // Inter-arrival times 10 and 4; response times 5 and 8.
  const Verified shortest(std::string(kTwoRuns) + "\n29 start fusion release=24");
  EXPECT_EQ(shortest["R1"], Verdict::fail);
  // Its own end was not before the next release, whenever that was.
  const Verified hung(R"(
    callback fusion timer period=10 pooled
    thread a pool
    thread b pool
    12 start fusion release=10 on=a
    22 start fusion release=20 on=b
    24 end fusion on=b seq=1)");
  EXPECT_EQ(hung["R1"], Verdict::fail);
  EXPECT_THAT(hung.evidence("R1", "callback fusion"),
              AllOf(HasSubstr("12 callback_start seq 0 starts and never ends"),
                    HasSubstr("22 callback_start the next instance was released at 20")));
}

// What stands in the trace stands, wherever the stream of another CPU begins or ends.
TEST(ArrivalExceedsTurnaround, KeepsItsFailureOutsideOfWhatAllStreamsCover) {
  constexpr const char* kOverrun = R"(
    callback fusion timer period=10
    12 start fusion release=10
    15 end fusion
    22 start fusion release=20
    31 end fusion
    32 start fusion release=30
    35 end fusion
    42 start fusion release=40
    45 end fusion
    52 start fusion release=50
    55 end fusion)";
  const auto judged = [](const char* runs, std::optional<std::int64_t> begin,
                         std::optional<std::int64_t> end) {
    return Verified(beside_stream(trace_of(runs), begin, end));
  };
  for (const auto end : {17, 21}) {
    const auto verified = judged(kOverrun, std::nullopt, end);
    EXPECT_EQ(verified.of("R1", "callback fusion"), Verdict::fail) << end;
    EXPECT_THAT(verified.evidence("R1", "callback fusion"),
                HasSubstr("the next instance was released at 30, not after the end of seq 1; "
                          "outside of what all streams cover"))
        << end;
  }
  EXPECT_EQ(judged(kOverrun, {}, 33).of("R1", "callback fusion"), Verdict::fail);
  for (const auto begin : {21, 31, 36})
    EXPECT_EQ(judged(kOverrun, begin, std::nullopt).of("R1", "callback fusion"), Verdict::fail)
        << begin;
  // The shortest inter-arrival time is inside, the longest response time is not.
  constexpr const char* kUneven = R"(
    callback fusion timer period=10
    12 start fusion release=10
    15 end fusion
    22 start fusion release=20
    25 end fusion
    42 start fusion release=40
    55 end fusion)";
  const auto uneven = judged(kUneven, std::nullopt, 30);
  EXPECT_EQ(uneven.of("R1", "callback fusion"), Verdict::fail);
  EXPECT_THAT(uneven.evidence("R1", "callback fusion"),
              AllOf(HasSubstr("longest response time: at least 15 ns; outside"),
                    HasSubstr("was released 10 ns after the one before it")));
  EXPECT_EQ(judged(kTwoRuns, std::nullopt, 17).of("R1", "callback fusion"),
            Verdict::not_applicable);
}

TEST(NoMissedRelease, CountsSkippedPeriodsOverTheRun) {
  constexpr auto kMissed = R"(
    callback fusion timer period=10
    12 start fusion release=10
    15 end fusion
    42 start fusion release=40 missed=2
    45 end fusion
    62 start fusion release=60 missed=1
    65 end fusion)";
  EXPECT_EQ(Verified(kTwoRuns)["R2"], Verdict::pass);
  const Verified verified(kMissed);
  EXPECT_EQ(verified.of("R2", "callback fusion"), Verdict::fail);
  EXPECT_THAT(verified.evidence("R2", "callback fusion"),
              AllOf(HasSubstr("42 callback_start seq 1: 2 periods were skipped"),
                    HasSubstr("3 periods skipped in all, 0 allowed")));
  EXPECT_EQ(Verified(kMissed, spec("missed_releases_allowed: 2"))["R2"], Verdict::fail);
  EXPECT_EQ(Verified(kMissed, spec("missed_releases_allowed: 3"))["R2"], Verdict::pass);
}

TEST(NoMissedRelease, SaysAtLeastHowManyWhereOneReleaseIsNotKnown) {
  const Verified verified(std::string(kTwoRuns) +
                          "\n42 start fusion release=40 missed=1\n45 end fusion"
                          "\n62 start fusion release=none\n65 end fusion");
  EXPECT_EQ(verified["R2"], Verdict::fail);
  EXPECT_THAT(verified.evidence("R2", "callback fusion"),
              HasSubstr("at least 1 period skipped in all, 0 allowed"));
}

TEST(NoMissedRelease, CountsThoseBeforeAnOpenInstance) {
  EXPECT_EQ(Verified(std::string(kTwoRuns) + "\n42 start fusion release=40 missed=1")["R2"],
            Verdict::fail);
}

TEST(NoMissedRelease, IsInconclusiveWithoutExpiriesAndUnderLoss) {
  EXPECT_EQ(Verified("callback fusion timer\n2 start fusion\n3 end fusion")["R2"],
            Verdict::inconclusive);
  auto trace = trace_of(kTwoRuns);
  drop_first_instance(trace);
  EXPECT_EQ(Verified(trace)["R2"], Verdict::inconclusive);
}

TEST(NoMissedRelease, IsInconclusiveWithoutTheExpiryOfAnInstanceThatNeverEnded) {
  const auto judged = [](const std::string& release) {
    return Verified(
        "callback fusion timer period=10\n12 start fusion release=10\n15 end fusion\n"
        "22 start fusion release=" +
        release + "\n32 start fusion release=30\n38 end fusion seq=2");
  };
  EXPECT_EQ(judged("20")["R2"], Verdict::pass);
  EXPECT_EQ(judged("none")["R2"], Verdict::inconclusive);
}

TEST(NoMissedRelease, JudgesTimersOnly) {
  EXPECT_EQ(Verified("callback fusion subscription\n2 start fusion release=1\n3 end fusion")["R2"],
            Verdict::not_applicable);
}

TEST(Rate, BoundsInterArrivalTimes) {
  EXPECT_EQ(Verified(kTwoRuns, spec("min_inter_arrival: 10\n    max_inter_arrival: 10"))["R5"],
            Verdict::pass);
  const Verified fast(kTwoRuns, spec("min_inter_arrival: 11"));
  EXPECT_EQ(fast.of("R5", "callback fusion"), Verdict::fail);
  EXPECT_THAT(fast.evidence("R5", "callback fusion"),
              HasSubstr("22 callback_start seq 1 was released 10 ns after the one before it; "
                        "spec.yaml:2 declares at least 11 ns"));
  EXPECT_EQ(Verified(kTwoRuns, spec("max_inter_arrival: 9"))["R5"], Verdict::fail);
}

TEST(Rate, CountsTheReleaseOfAnInstanceThatNeverEnded) {
  constexpr const char* kBounds = "min_inter_arrival: 10\n    max_inter_arrival: 12";
  const auto open_at = [&](const char* release) {
    return Verified(std::string(kTwoRuns) + "\n42 start fusion release=" + release, spec(kBounds));
  };
  EXPECT_EQ(open_at("32")["R5"], Verdict::pass);
  EXPECT_EQ(open_at("33")["R5"], Verdict::fail);
  EXPECT_EQ(open_at("29")["R5"], Verdict::fail);
  EXPECT_THAT(open_at("29").evidence("R5", "callback fusion"),
              HasSubstr("42 callback_start seq 2 was released 9 ns after the one before it"));
  EXPECT_EQ(open_at("29").result.report.callbacks.front().inter_arrival->count, 1U)
      << "the report's numbers are of complete instances";
  constexpr const char* kOne =
      "callback fusion timer period=10\n12 start fusion release=10\n15 end fusion\n"
      "22 start fusion release=20";
  EXPECT_EQ(Verified(kOne, spec("min_inter_arrival: 11"))["R5"], Verdict::fail);
  EXPECT_EQ(Verified(kOne, spec("min_inter_arrival: 10"))["R5"], Verdict::pass);
}

// As a client's response that is served before an older request's timeout: 20, 16, 40.
TEST(Rate, KeepsItsFailureOutsideOfWhatAllStreamsCover) {
  constexpr const char* kUneven = R"(
    callback fusion timer period=10
    12 start fusion release=10
    13 end fusion
    22 start fusion release=20
    23 end fusion
    27 start fusion release=25
    28 end fusion
    42 start fusion release=40
    43 end fusion
    52 start fusion release=50
    53 end fusion)";
  for (const std::string bound : {"min_inter_arrival: 6", "max_inter_arrival: 14"}) {
    const auto judged = [&](std::optional<std::int64_t> begin, std::optional<std::int64_t> end) {
      return Verified(beside_stream(trace_of(kUneven), begin, end), spec(bound));
    };
    for (const auto end : {18, 26, 30})
      EXPECT_EQ(judged({}, end).of("R5", "callback fusion"), Verdict::fail) << bound << ' ' << end;
    for (const auto begin : {21, 26, 30, 45}) {
      EXPECT_EQ(judged(begin, {}).of("R5", "callback fusion"), Verdict::fail)
          << bound << ' ' << begin;
    }
    EXPECT_THAT(judged({}, 18).evidence("R5", "callback fusion"),
                HasSubstr("outside of what all streams cover, so not counted"));
  }
  EXPECT_EQ(Verified(beside_stream(trace_of(kUneven), {}, 48), spec("max_inter_arrival: 15"))
                .of("R5", "callback fusion"),
            Verdict::pass);
}

TEST(Rate, IsNotJudgedByInstancesInAnotherOrderThanTheirReleases) {
  constexpr const char* kReordered =
      "callback fusion timer period=10\n22 start fusion release=20\n25 end fusion\n"
      "26 start fusion release=16\n27 end fusion\n42 start fusion release=40\n45 end fusion";
  const auto rate = [&](const char* declared) { return Verified(kReordered, spec(declared)); };
  EXPECT_EQ(rate("min_inter_arrival: 4")["R5"], Verdict::inconclusive);
  EXPECT_EQ(rate("max_inter_arrival: 20")["R5"], Verdict::inconclusive) << "20 lies between";
  EXPECT_EQ(rate("min_inter_arrival: 25")["R5"], Verdict::fail) << "16 and 40 are nearer";
  const auto turnaround = rate("min_inter_arrival: 4");
  EXPECT_EQ(turnaround["R1"], Verdict::fail) << "16 was released before the end at 25";
  EXPECT_THAT(turnaround.evidence("R1", "callback fusion"), testing::Not(HasSubstr("-4 ns")));
}

TEST(Rate, IsInconclusiveUnderLossAndWithoutReleases) {
  auto trace = trace_of(kTwoRuns);
  drop_first_instance(trace);
  EXPECT_EQ(Verified(trace, spec("min_inter_arrival: 1"))["R5"], Verdict::inconclusive);
  EXPECT_EQ(Verified("callback fusion\n2 start fusion\n3 end fusion\n12 start fusion\n"
                     "13 end fusion",
                     spec("min_inter_arrival: 1"))["R5"],
            Verdict::inconclusive);
}

}  // namespace
}  // namespace cie::test
