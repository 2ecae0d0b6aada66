// Numbers and timestamps of one writer's messages, from one thread and from several.
#include "provider/message_clock.hpp"

#include <algorithm>
#include <cstdint>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::trace {
namespace {

TEST(MessageClock, CountsFromZeroAndTakesTheTimeItIsGiven) {
  MessageClock clock;
  EXPECT_EQ(clock.count(), 0U);
  const MessageStamp first = clock.next(1000);
  const MessageStamp second = clock.next(2000);
  EXPECT_EQ(first.seq, 0U);
  EXPECT_EQ(first.source_timestamp_realtime_ns, 1000);
  EXPECT_EQ(second.seq, 1U);
  EXPECT_EQ(second.source_timestamp_realtime_ns, 2000);
  EXPECT_EQ(clock.count(), 2U);
}

TEST(MessageClock, GoesOneNanosecondOnWhenTheClockStandsStillOrSteppedBack) {
  MessageClock clock;
  EXPECT_EQ(clock.next(5000).source_timestamp_realtime_ns, 5000);
  EXPECT_EQ(clock.next(5000).source_timestamp_realtime_ns, 5001);
  EXPECT_EQ(clock.next(10).source_timestamp_realtime_ns, 5002);
  EXPECT_EQ(clock.next(6000).source_timestamp_realtime_ns, 6000);
}

TEST(MessageClock, KeepsTheTwoCallsOfOneMessageInStep) {
  MessageClock clock;
  const std::int64_t stamp = clock.next_timestamp(100);
  EXPECT_EQ(stamp, 100);
  EXPECT_EQ(clock.count(), 0U);
  EXPECT_EQ(clock.next_seq_at(stamp), 0U);
  EXPECT_EQ(clock.next_timestamp(100), 101);
  // A timestamp of the caller's own raises what follows.
  EXPECT_EQ(clock.next_seq_at(900), 1U);
  EXPECT_EQ(clock.next_timestamp(200), 901);
}

TEST(MessageClock, LetsNumberAndTimestampRiseTogetherWhoeverPublishes) {
  constexpr std::size_t kThreads = 4;
  constexpr std::size_t kMessages = 20'000;
  MessageClock clock;
  std::vector<std::vector<MessageStamp>> stamps(kThreads);
  {
    std::vector<std::jthread> threads;
    for (std::size_t thread = 0; thread < kThreads; ++thread) {
      threads.emplace_back([&clock, &own = stamps[thread]] {
        for (std::size_t message = 0; message < kMessages; ++message) {
          own.push_back(clock.next(static_cast<std::int64_t>(message)));
        }
      });
    }
  }
  std::vector<MessageStamp> all;
  for (const auto& own : stamps) {
    all.insert(all.end(), own.begin(), own.end());
  }
  std::ranges::sort(all, {}, &MessageStamp::seq);
  ASSERT_EQ(all.size(), kThreads * kMessages);
  for (std::size_t i = 0; i < all.size(); ++i) {
    ASSERT_EQ(all[i].seq, i);
    if (i > 0) {
      ASSERT_LT(all[i - 1].source_timestamp_realtime_ns, all[i].source_timestamp_realtime_ns);
    }
  }
  EXPECT_EQ(clock.count(), all.size());
}

}  // namespace
}  // namespace cie::trace
