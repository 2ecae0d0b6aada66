#include "inbox.hpp"

#include <cie/scheduling/clock.hpp>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie_rclcpp {
namespace {

using Source = Inbox::Source;

Arrival at(std::int64_t time, int entity = 0) {
  return {.monotonic_ns = time, .realtime_ns = time + 1000, .entity = entity};
}

TEST(ArrivalQueue, GivesWhatCameInOrder) {
  ArrivalQueue queue{3};
  EXPECT_FALSE(queue.take());
  EXPECT_FALSE(queue.oldest());
  for (int i = 1; i <= 3; ++i)
    queue.add(at(i, 10 * i));
  EXPECT_EQ(queue.queued(), 3U);
  EXPECT_EQ(queue.oldest(), 1);
  for (int i = 1; i <= 3; ++i) {
    const auto arrival = queue.take();
    ASSERT_TRUE(arrival);
    EXPECT_EQ(arrival->monotonic_ns, i);
    EXPECT_EQ(arrival->realtime_ns, 1000 + i);
    EXPECT_EQ(arrival->entity, 10 * i);
  }
  EXPECT_FALSE(queue.take());
  EXPECT_EQ(queue.overwritten(), 0U);
}

TEST(ArrivalQueue, KeepsTheLatestOfItsDepth) {
  ArrivalQueue queue{2};
  for (int i = 1; i <= 5; ++i)
    queue.add(at(i));
  EXPECT_EQ(queue.queued(), 2U);
  EXPECT_EQ(queue.overwritten(), 3U);
  EXPECT_EQ(queue.oldest(), 4);
  EXPECT_EQ(queue.take()->monotonic_ns, 4);
  EXPECT_EQ(queue.take()->monotonic_ns, 5);
  EXPECT_FALSE(queue.take());
  EXPECT_EQ(queue.overwritten(), 3U);
}

// Without a bound nothing counts as overwritten; times beyond the room are not known any more.
TEST(ArrivalQueue, LosesTimesButNoAnnouncementWithoutABound) {
  ArrivalQueue queue{0};
  constexpr int kCount = 3000;
  for (int i = 0; i < kCount; ++i)
    queue.add(at(i));
  EXPECT_EQ(queue.queued(), 3000U);
  EXPECT_EQ(queue.overwritten(), 0U);
  for (int i = 0; i < kCount; ++i) {
    const auto arrival = queue.take();
    ASSERT_TRUE(arrival);
    EXPECT_TRUE(arrival->monotonic_ns == i || (i <= kCount - 1024 && arrival->monotonic_ns == -1))
        << i;
  }
  EXPECT_FALSE(queue.take());
}

// Every announcement is taken, waits or was overwritten; and no look at the counter, at whatever
// moment, is above what it is in the end.
void count_under_concurrency(std::size_t depth, int takers) {
  constexpr std::uint64_t kAnnounced = 300'000;
  ArrivalQueue queue{depth};
  std::atomic<bool> is_done{false};
  std::atomic<std::uint64_t> taken{0};
  std::atomic<std::uint64_t> highest{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < takers; ++i) {
    threads.emplace_back([&] {
      std::int64_t latest = -1;
      while (!is_done) {
        const auto arrival = queue.take();
        if (arrival) {
          ++taken;
          if (arrival->monotonic_ns >= 0) {
            EXPECT_GT(arrival->monotonic_ns, latest);
            latest = arrival->monotonic_ns;
          }
        }
        const std::uint64_t seen = queue.overwritten();
        std::uint64_t known = highest.load();
        while (seen > known && !highest.compare_exchange_weak(known, seen)) {
        }
      }
    });
  }
  for (std::uint64_t i = 0; i < kAnnounced; ++i)
    queue.add(at(static_cast<std::int64_t>(i)));
  is_done = true;
  for (auto& thread : threads)
    thread.join();
  EXPECT_EQ(taken + queue.queued() + queue.overwritten(), kAnnounced);
  EXPECT_LE(highest, queue.overwritten());
  EXPECT_LE(highest, kAnnounced - taken);
}
TEST(ArrivalQueue, CountsRightBesideOneTaker) { count_under_concurrency(1, 1); }
TEST(ArrivalQueue, CountsRightBesideMany) {
  count_under_concurrency(1, 3);
  count_under_concurrency(10, 3);
}

TEST(Inbox, WhatCameBeforeIsOfUnknownTime) {
  Inbox inbox{10, 0};
  inbox.connect([&] { inbox.announce(Source::middleware, 2, 0); });
  const std::int64_t before = cie::scheduling::monotonic_now();
  inbox.announce(Source::middleware, 1, 0);
  const std::int64_t after = cie::scheduling::monotonic_now();
  EXPECT_EQ(inbox.queued(), 3U);
  EXPECT_EQ(inbox.take()->arrival.monotonic_ns, -1);
  EXPECT_EQ(inbox.take()->arrival.monotonic_ns, -1);
  const auto later = inbox.take();
  EXPECT_GE(later->arrival.monotonic_ns, before);
  EXPECT_LE(later->arrival.monotonic_ns, after);
}

// One that arrives on another thread while it registers did arrive just then.
TEST(Inbox, AnArrivalElsewhereWhileItRegistersHasItsTime) {
  Inbox inbox{10, 0};
  inbox.connect([&] { std::thread{[&] { inbox.announce(Source::middleware, 1, 0); }}.join(); });
  EXPECT_GT(inbox.take()->arrival.monotonic_ns, 0);
}

TEST(Inbox, ForgetsThatItRegistersWhereThatThrows) {
  Inbox inbox{10, 0};
  EXPECT_THROW(inbox.connect([] { throw std::runtime_error{"no"}; }), std::runtime_error);
  inbox.announce(Source::middleware, 1, 0);
  EXPECT_GT(inbox.take()->arrival.monotonic_ns, 0);
}

// Of the two ways to a subscription the one that was announced first is taken first.
TEST(Inbox, TakesTheOldestOfBothSources) {
  Inbox inbox{10, 10};
  const Source order[] = {Source::process, Source::middleware, Source::middleware, Source::process};
  for (const Source source : order)
    inbox.announce(source, 1, 0);
  for (const Source source : order)
    EXPECT_EQ(inbox.take()->source, source);
  EXPECT_FALSE(inbox.take());
}

class Sink final : public cie::scheduling::ReadySink {
 public:
  void on_ready(cie::scheduling::Callback&) noexcept override { ++told; }
  int told = 0;
};

class Idle final : public cie::scheduling::Callback {
 public:
  Idle() : Callback(nullptr, {.logical_id = "/test@Waitable(idle)"}) {}
  std::int64_t next_due() const noexcept override { return cie::scheduling::kNever; }
  void serve(cie::scheduling::ReadySink*) override {}
  bool run_one() override { return false; }
};

TEST(Inbox, TellsItsTargetAndNobodyAfterwards) {
  Inbox inbox{1, 0};
  Sink sink;
  Idle callback;
  inbox.announce(Source::middleware, 1, 0);
  inbox.set_target(&sink, &callback);
  inbox.announce(Source::middleware, 3, 0);
  EXPECT_EQ(sink.told, 1) << "once for all that came at once";
  inbox.wake();
  EXPECT_EQ(sink.told, 2);
  inbox.set_target(nullptr, nullptr);
  inbox.announce(Source::middleware, 1, 0);
  inbox.wake();
  EXPECT_EQ(sink.told, 2);
  EXPECT_EQ(inbox.overwritten(), 3U) << "one may have been a writer's end";
}

}  // namespace
}  // namespace cie_rclcpp
