#include "knowledge/gap_lane.hpp"

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

Gap gap(std::int64_t from, std::int64_t to, std::optional<std::uint64_t> at_most = std::nullopt) {
  Gap made;
  made.kinds = EventKind::run_start;
  made.window = {Timestamp{from}, Timestamp{to}};
  made.at_most = at_most;
  made.reason.at = Timestamp{from};
  return made;
}

TEST(GapLane, JoinsGapsThatOverlapAndAddsTheirCounts) {
  GapLane lane{100};
  lane.add(gap(10, 20, 2));
  lane.add(gap(30, 40, 1));
  lane.add(gap(15, 35, 4));
  ASSERT_EQ(lane.size(), 1U);
  const auto* held = lane.from(Timestamp{0});
  EXPECT_EQ(held->gap.window, (TimeWindow{Timestamp{10}, Timestamp{40}}));
  EXPECT_EQ(held->gap.at_most, 7U);
  EXPECT_EQ(held->gap.reason.at, Timestamp{10});
}

TEST(GapLane, HasNoCountWhereOneOfThoseJoinedHasNone) {
  GapLane lane{100};
  lane.add(gap(10, 20, 2));
  lane.add(gap(20, 25));
  EXPECT_EQ(lane.from(Timestamp{0})->gap.at_most, std::nullopt);
}

TEST(GapLane, FindsTheGapAtATimeOrTheNextOne) {
  GapLane lane{100};
  lane.add(gap(10, 20));
  lane.add(gap(30, 40));
  EXPECT_EQ(lane.from(Timestamp{20})->gap.window.from, Timestamp{10});
  EXPECT_EQ(lane.from(Timestamp{21})->gap.window.from, Timestamp{30});
  EXPECT_EQ(lane.from(Timestamp{41}), nullptr);
  EXPECT_EQ(lane.until(Timestamp{9}), nullptr);
  EXPECT_EQ(lane.until(Timestamp{29})->gap.window.from, Timestamp{10});
}

TEST(GapLane, HidesNothingInAnEmptyWindowOrWithACountOfZero) {
  GapLane lane{100};
  lane.add(gap(20, 10));
  lane.add(gap(10, 20, 0));
  EXPECT_EQ(lane.size(), 0U);
}

TEST(GapLane, JoinsTooManyAndDropsNone) {
  constexpr std::int64_t kGaps = 100'001;
  GapLane lane{1000};
  for (std::int64_t i = 0; i < kGaps; ++i) {
    lane.add(gap(10 * i, 10 * i + 1, 1));
  }
  EXPECT_LE(lane.size(), 1000U);
  std::uint64_t hidden = 0;
  for (const auto* held = lane.from(kEarliest); held != nullptr;
       held = lane.from(Timestamp{held->gap.window.to.ns + 1})) {
    hidden += *held->gap.at_most;
  }
  EXPECT_EQ(hidden, static_cast<std::uint64_t>(kGaps));
  EXPECT_LE(lane.from(Timestamp{10 * (kGaps - 1)})->gap.window.from, Timestamp{10 * (kGaps - 1)});
}

}  // namespace
}  // namespace cie::analysis
