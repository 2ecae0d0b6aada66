// How a callback kept its deadline before and after.
#include "compared_callbacks.hpp"

#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

TEST(Lateness, IsThatOfTheCallbacksDeadline) {
  CallbackReport report;
  EXPECT_EQ(Lateness::of(report), std::nullopt) << "no deadline";
  report.response_deadline = Duration{100};
  report.late = 3;
  report.instances = 8;
  report.response_time = Summary{.count = 8, .max = 170};
  const Lateness expected{.deadline = {100}, .late = 3, .instances = 8, .max = 170};
  EXPECT_EQ(Lateness::of(report), expected);
  report.response_time_lower = Summary{.count = 1, .max = 169};
  auto at_least = expected;
  at_least.is_max_bound = true;
  at_least.is_late_bound = true;
  EXPECT_EQ(Lateness::of(report), at_least) << "which may have taken longer than the longest";
  report.response_time_lower->max = 90;
  report.response_time_upper = Summary{.count = 1, .max = 100};
  EXPECT_EQ(Lateness::of(report), expected) << "which did not";
  report.response_time_upper->max = 170;
  at_least.is_max_bound = false;
  EXPECT_EQ(Lateness::of(report), at_least) << "nor is it known to be in time";
  report.response_time_lower->max = at_least.max.emplace(300);
  report.response_time_upper->max = 400;
  at_least.is_max_bound = true;
  EXPECT_EQ(Lateness::of(report), at_least);
}

CallbackSample late(std::uint64_t count, std::uint64_t of) {
  CallbackSample sample;
  sample.logical_id = "/a";
  sample.instances = of;
  sample.lateness = Lateness{.deadline = {100}, .late = count, .instances = of, .max = {}};
  return sample;
}

Change change_of_late(const CallbackSample& before, const CallbackSample& after) {
  return change(before, after).of(Count::late).change;
}

TEST(Lateness, IsKeptOfBothSides) {
  CallbackSample without;
  without.logical_id = "/a";
  const auto found = compared(late(3, 8), without).callbacks.at(0);
  EXPECT_EQ(found.lateness_before, late(3, 8).lateness);
  EXPECT_EQ(found.lateness_after, std::nullopt);
  EXPECT_EQ(found.of(Count::late).change, Change::undecided);
}

// None of 20 000 before and 100 after, of equal rates, has the probability 0.5^100.
TEST(Lateness, IsARegressionBeyondChance) {
  const auto worse = compared(late(0, 20'000), late(100, 20'000));
  EXPECT_EQ(worse.callbacks.at(0).of(Count::late).change, Change::worse);
  EXPECT_EQ(worse.outcome(), Outcome::regression);
  EXPECT_EQ(change_of_late(late(100, 20'000), late(0, 20'000)), Change::better);
  EXPECT_EQ(change_of_late(late(0, 20'000), late(9, 20'000)), Change::undecided);
  EXPECT_EQ(change_of_late(late(0, 20'000), late(0, 20'000)), Change::within);
  EXPECT_EQ(change_of_late(late(100, 20'000), late(50, 10'000)), Change::undecided);
}

TEST(Lateness, IsUndecidedOfTwoDeadlines) {
  auto other = late(100, 20'000);
  other.lateness->deadline = Duration{50};
  EXPECT_EQ(change_of_late(late(0, 20'000), other), Change::undecided);
}

TEST(Lateness, IsUndecidedWhereMoreMayHaveBeenLateThanIsKnown) {
  auto none = late(0, 20'000);
  none.lateness->is_late_bound = true;
  auto many = late(100, 20'000);
  EXPECT_EQ(change_of_late(none, many), Change::undecided);
  EXPECT_EQ(change_of_late(many, none), Change::undecided);
  many.lateness->is_late_bound = true;
  EXPECT_EQ(change_of_late(late(0, 20'000), many), Change::worse) << "the more the worse";
  EXPECT_EQ(change_of_late(many, late(0, 20'000)), Change::better);
}

// Up to 10 us too late, say.
TEST(Lateness, OfCalculatedReleasesIsKnownWhereAllAreFarBelowTheDeadline) {
  CallbackReport report;
  report.response_deadline = Duration{100'000};
  report.late = 0;
  report.instances = 8;
  report.release_error = Duration{10'000};
  report.response_time = Summary{.count = 8, .max = 90'000};
  EXPECT_FALSE(Lateness::of(report)->is_late_bound);
  report.response_time->max = 90'001;
  EXPECT_TRUE(Lateness::of(report)->is_late_bound);
}

}  // namespace
}  // namespace cie::analysis
