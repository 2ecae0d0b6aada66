#include "trackers/sequence_tracker.hpp"

#include <initializer_list>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// Numbers seen one after the other, at times 10, 20, 30, …
struct Series {
  explicit Series(std::initializer_list<std::uint64_t> numbers) {
    for (const auto number : numbers)
      see(number);
  }
  void see(std::uint64_t number) {
    time.ns += 10;
    tracker.observe(number, EventRef{.time = time}, facts);
  }
  SequenceFacts finished() {
    tracker.finish(facts);
    return facts;
  }
  SequenceTracker tracker;
  SequenceFacts facts;
  Timestamp time;
};

TEST(SequenceTracker, ContiguousNumbersMissNothing) {
  const auto facts = Series({4, 5, 6}).finished();
  EXPECT_EQ(facts.missing, 0U);
  EXPECT_EQ(facts.count, 3U);
  EXPECT_EQ(facts.first, 4U);
  EXPECT_EQ(facts.last, 6U);
  EXPECT_FALSE(facts.first_gap.has_value());
}

TEST(SequenceTracker, AJumpIsAHoleWithItsNeighbours) {
  const auto facts = Series({0, 1, 5}).finished();
  EXPECT_EQ(facts.missing, 3U);
  ASSERT_TRUE(facts.first_gap.has_value());
  EXPECT_EQ(facts.first_gap->expected, 2U);
  EXPECT_EQ(facts.first_gap->seen, 5U);
  EXPECT_EQ(facts.first_gap->before.time.ns, 20);
  EXPECT_EQ(facts.first_gap->after.time.ns, 30);
}

TEST(SequenceTracker, AHoleFilledLaterIsNone) {
  EXPECT_EQ(Series({0, 3, 2, 1, 4}).finished().missing, 0U);
  EXPECT_EQ(Series({0, 4, 2, 5}).finished().missing, 2U);  // 1 and 3
  EXPECT_EQ(Series({1, 0, 2}).finished().missing, 0U);
}

TEST(SequenceTracker, ARepeatedNumberIsCountedAsSuch) {
  const auto facts = Series({0, 1, 1, 2}).finished();
  EXPECT_EQ(facts.missing, 0U);
  EXPECT_EQ(facts.repeated, 1U);
}

TEST(SequenceTracker, AFirstNumberAboveThePromisedOneIsAHole) {
  Series series({7, 8});
  series.tracker.finish(5, EventRef{.time = {1}}, series.facts);
  EXPECT_EQ(series.facts.missing, 2U);
  EXPECT_EQ(series.facts.first_gap->expected, 5U);
}

TEST(SequenceTracker, AnAnnouncementThatCameLaterPromisesNothing) {
  Series series({7, 8});
  series.tracker.finish(9, EventRef{.time = {100}}, series.facts);
  EXPECT_EQ(series.facts.missing, 0U);
}

TEST(SequenceTracker, TellsWhetherANumberOrRangeIsMissing) {
  Series series({0, 1, 5, 6});
  EXPECT_TRUE(series.tracker.is_missing(2));
  EXPECT_FALSE(series.tracker.is_missing(5));
  EXPECT_FALSE(series.tracker.is_missing(7));  // not yet seen is not missing
  EXPECT_TRUE(series.tracker.has_hole_between(1, 5));
  EXPECT_TRUE(series.tracker.has_hole_between(0, 3));
  EXPECT_FALSE(series.tracker.has_hole_between(5, 6));
  EXPECT_FALSE(series.tracker.has_hole_between(0, 1));
}

TEST(SequenceTracker, ANewSeriesBeginsAtZero) {
  Series series({0, 1, 2});
  SequenceTracker::restart(series.facts);
  series.see(0);
  series.see(1);
  EXPECT_EQ(series.finished().missing, 0U);

  Series incomplete({0, 1, 2});
  SequenceTracker::restart(incomplete.facts);
  incomplete.see(2);
  EXPECT_EQ(incomplete.finished().missing, 2U);
}

TEST(SequenceTracker, HostileNumbersKeepItBounded) {
  Series series({0});
  for (std::uint64_t i = 1; i < 5'000; ++i)
    series.see(i * 1'000'003);
  series.see(0xffff'ffff'ffff'ffffU);
  EXPECT_GT(series.finished().missing, 4'999U * 1'000'002U);
}

// Ends of instances that began before the first start seen: some may have come before the record.
TEST(SequenceTracker, CountsHolesFromANumberOn) {
  const auto from = [](std::uint64_t first, std::initializer_list<std::uint64_t> numbers) {
    Series series(numbers);
    series.tracker.finish_from(first, EventRef{}, series.facts);
    return series.facts.missing;
  };
  EXPECT_EQ(from(5, {3, 5, 6}), 0U) << "4 is below";
  EXPECT_EQ(from(4, {3, 5, 6}), 1U);
  EXPECT_EQ(from(4, {1, 7}), 3U) << "4, 5 and 6";
  EXPECT_EQ(from(4, {6, 7}), 2U) << "4 and 5";
}

TEST(SequenceTracker, KnowsItsLastHolesHoweverManyThereWere) {
  Series series({0});
  for (std::uint64_t i = 1; i <= 1000; ++i) {  // 3, 4, 6, 7, 9, …: each third number is missing
    series.see(3 * i);
    series.see(3 * i + 1);
  }
  EXPECT_EQ(series.finished().missing, 2U + 999U);
  EXPECT_EQ(series.facts.first_gap->expected, 1U);
  EXPECT_FALSE(series.tracker.has_hole_between(3000, 3001));
  EXPECT_TRUE(series.tracker.has_hole_between(2998, 3000));
  EXPECT_TRUE(series.tracker.has_hole_between(30, 31)) << "long ago: it may have one";
}

}  // namespace
}  // namespace cie::analysis
