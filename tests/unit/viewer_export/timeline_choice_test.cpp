// Which instances a picture of bounded size keeps.
#include "timelines/timeline_choice.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

constexpr std::int64_t kPeriod = 1000;

analysis::Instance instance(std::uint64_t number, std::int64_t response = 10) {
  analysis::Instance made;
  made.start = {static_cast<std::int64_t>(number) * kPeriod};
  made.release = made.start;
  made.release_source = analysis::ReleaseSource::exact;
  made.end = analysis::Timestamp{made.start.ns + response};
  made.tid = 1;
  made.seq = number;
  return made;
}

KeptInstance run(std::uint64_t number, std::int64_t response = 10) {
  return KeptInstance::of(instance(number, response));
}

std::set<std::uint64_t> numbers_of(const TimelineChoice::Kept& kept) {
  std::set<std::uint64_t> numbers;
  for (const auto& instance : kept.instances)
    numbers.insert(instance.seq);
  return numbers;
}

TEST(TimelineChoice, KeepsAllThereIsRoomFor) {
  TimelineChoice choice(100);
  for (std::uint64_t i = 0; i < 100; ++i)
    choice.add(run(i));
  const auto lanes = choice.take();
  ASSERT_EQ(lanes.size(), 1U);
  EXPECT_EQ(lanes[0].of, 100U);
  EXPECT_EQ(lanes[0].instances.size(), 100U)
      << "none twice, though all are among the slowest or not";
}

TEST(TimelineChoice, ThinsOutEvenlyAndKeepsTheSlowest) {
  TimelineChoice choice(1000);
  constexpr std::uint64_t kCount = 100'000;
  for (std::uint64_t i = 0; i < kCount; ++i)
    choice.add(run(i, i % 997 == 996 ? 500 : 10));  // 100 slow ones
  const auto lanes = choice.take();
  EXPECT_EQ(lanes[0].of, kCount);
  EXPECT_LE(lanes[0].instances.size(), 1050U);
  EXPECT_GE(lanes[0].instances.size(), 500U) << "half of the room at least is used";
  const auto slow = std::ranges::count_if(
      lanes[0].instances, [](const KeptInstance& i) { return i.response() == 500; });
  EXPECT_GE(slow, 50);
  // No hole is larger than twice the even distance between those kept.
  std::int64_t before = 0;
  for (const auto& instance : lanes[0].instances) {
    EXPECT_LE(instance.start - before, 256 * kPeriod);
    before = instance.start;
  }
}

TEST(TimelineChoice, TakesFromTheCallbackThatHasMost) {
  TimelineChoice choice(1000);
  for (std::uint64_t i = 0; i < 100; ++i) {
    auto rare = instance(i);
    rare.callback = analysis::CallbackIndex{1};
    choice.add(KeptInstance::of(rare));
  }
  for (std::uint64_t i = 0; i < 10'000; ++i)
    choice.add(run(i));
  const auto lanes = choice.take();
  ASSERT_EQ(lanes.size(), 2U);
  EXPECT_EQ(lanes[1].instances.size(), 100U) << "a rare callback is kept whole";
  EXPECT_LE(lanes[0].instances.size(), 950U);
}

TEST(TimelineChoice, KeepsWhatNeverEndedOrMissedReleases) {
  TimelineChoice choice(100);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    auto some = instance(i);
    if (i == 4321) some.missed = 3;
    if (i == 9999) some.end.reset();
    choice.add(KeptInstance::of(some));
  }
  const auto numbers = numbers_of(choice.take()[0]);
  EXPECT_TRUE(numbers.contains(4321));
  EXPECT_TRUE(numbers.contains(9999));
}

TEST(TimelineChoice, KeepsTheLongestOfRunsWithoutAKnownRelease) {
  TimelineChoice choice(100);
  for (std::uint64_t i = 0; i < 10'000; ++i) {
    auto some = instance(i, i == 4321 ? 500 : 10);
    some.release.reset();
    some.release_source = analysis::ReleaseSource::start;
    choice.add(KeptInstance::of(some));
  }
  EXPECT_TRUE(numbers_of(choice.take()[0]).contains(4321));
}

TEST(TimelineChoice, SortsByStart) {
  TimelineChoice choice(10);
  choice.add(run(2));
  choice.add(run(1));
  const auto lanes = choice.take();
  EXPECT_TRUE(std::ranges::is_sorted(lanes[0].instances, {}, &KeptInstance::start));
}

TEST(TimelineChoice, ABoundOfAReleaseIsNoResponse) {
  auto bounded = instance(1);
  EXPECT_TRUE(KeptInstance::of(bounded).response().has_value());
  bounded.release_source = analysis::ReleaseSource::wakeup;
  EXPECT_FALSE(KeptInstance::of(bounded).response().has_value());
}

// Published at 1 of 10, runs from 10 to 12: a release is not before the publication, and may be as late as the start.
TEST(TimelineChoice, FromASourceTimestampNoLatencyIsCertain) {
  auto bounded = instance(1);
  bounded.start = {10};
  bounded.end = analysis::Timestamp{12};
  bounded.release = analysis::Timestamp{1};
  bounded.release_source = analysis::ReleaseSource::source_timestamp;
  EXPECT_FALSE(KeptInstance::of(bounded).least_start_latency());
  EXPECT_EQ(KeptInstance::of(bounded).least_response(), 12 - 10);
  bounded.release_source = analysis::ReleaseSource::wakeup;
  EXPECT_EQ(KeptInstance::of(bounded).least_response(), 12 - 1) << "it was released by then";
}

}  // namespace
}  // namespace cie::viewer_export
