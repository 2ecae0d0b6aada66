// Events that are found before their turn: by where and when each is after the one before it.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <ctf/stream/events_ahead.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

constexpr std::uint64_t kNanoseconds = 1'000'000'000;
constexpr std::uint64_t kFarthestTime = 0xffff'ffff;  // behind the one before: a little over 4 s
constexpr std::uint64_t kFarthestByte = 0xffff;

class EventsAheadTest : public testing::Test {
 protected:
  EventCursor::Fixed at(std::uint64_t byte, std::uint64_t time, bool is_other = false) const {
    return {.event_class = 7, .is_other = is_other, .body = data_.data() + byte, .clock = time};
  }
  EventsAhead ahead(std::uint64_t from, bool counts_others = false) {
    return {room_,
            data_.data(),
            Timestamp{static_cast<std::int64_t>(from)},
            {.frequency = kNanoseconds, .counts_others = counts_others}};
  }

  std::vector<std::uint8_t> data_ = std::vector<std::uint8_t>(200'000);
  std::array<EventAhead, 3> room_{};
};

TEST_F(EventsAheadTest, AreCountedFromTheOneBefore) {
  auto events = ahead(1000);
  EXPECT_FALSE(events.is_any());
  EXPECT_TRUE(events.take(at(4, 1000)));
  EXPECT_TRUE(events.take(at(44, 1030)));
  EXPECT_TRUE(events.take(at(60, 1030)));
  EXPECT_FALSE(events.take(at(80, 1040)));  // no room
  const auto run = events.run();
  ASSERT_EQ(run.events.size(), 3U);
  EXPECT_EQ(run.events[0].after_ns, 0U);
  EXPECT_EQ(run.events[0].distance, 4U);
  EXPECT_EQ(run.events[1].after_ns, 30U);
  EXPECT_EQ(run.events[1].distance, 40U);
  EXPECT_EQ(run.events[2].after_ns, 0U);
  EXPECT_EQ(run.events[2].distance, 16U);
  EXPECT_EQ(run.events[2].event_class, 7U);
  EXPECT_EQ(run.data, data_.data());
  EXPECT_EQ(run.first_time(), Timestamp{1000});
  EXPECT_EQ(run.to, Timestamp{1030});
  EXPECT_EQ(run.last, Timestamp{1030});
}

TEST_F(EventsAheadTest, EndBeforeOneThatIsEarlier) {
  auto events = ahead(1000);
  EXPECT_FALSE(events.take(at(4, 999)));
  EXPECT_TRUE(events.take(at(4, 1001)));
  EXPECT_FALSE(events.take(at(8, 1000)));
  EXPECT_EQ(events.run().events.size(), 1U);
}

TEST_F(EventsAheadTest, EndBeforeOneThatIsFarOff) {
  auto late = ahead(0);
  EXPECT_FALSE(late.take(at(4, kFarthestTime + 1)));
  EXPECT_TRUE(late.take(at(4, kFarthestTime)));
  EXPECT_FALSE(late.take(at(8, 2 * kFarthestTime + 1)));
  EXPECT_TRUE(late.take(at(8, 2 * kFarthestTime)));
  EXPECT_EQ(late.run().to.ns, static_cast<std::int64_t>(2 * kFarthestTime));
  auto large = ahead(0);
  EXPECT_FALSE(large.take(at(kFarthestByte + 1, 1)));
  EXPECT_TRUE(large.take(at(kFarthestByte, 1)));
  EXPECT_TRUE(large.take(at(2 * kFarthestByte, 2)));
}

TEST_F(EventsAheadTest, OthersAreOnlyCountedIfThatIsWanted) {
  auto told = ahead(0);
  EXPECT_TRUE(told.take(at(4, 1, true)));
  EXPECT_EQ(told.run().others, 0U);
  EXPECT_EQ(told.run().events.size(), 1U);
  auto counted = ahead(0, true);
  EXPECT_TRUE(counted.take(at(4, 1, true)));
  EXPECT_TRUE(counted.is_any());
  EXPECT_TRUE(counted.take(at(8, 5)));
  EXPECT_TRUE(counted.take(at(12, 9, true)));
  EXPECT_FALSE(counted.take(at(16, 8)));  // earlier than that
  EXPECT_EQ(counted.run().others, 2U);
  ASSERT_EQ(counted.run().events.size(), 1U);
  EXPECT_EQ(counted.run().events[0].after_ns, 5U);
  EXPECT_EQ(counted.run().events[0].distance, 8U);
  EXPECT_EQ(counted.run().to, Timestamp{5});
  EXPECT_EQ(counted.run().last, Timestamp{9});
}

}  // namespace
}  // namespace cie::analysis::ctf
