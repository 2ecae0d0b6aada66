// What a flight recorder keeps of the kernel's events.
#include "kernel/kernel_ring.hpp"

#include "kernel/kernel_record.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

using namespace std::chrono_literals;

constexpr std::uint64_t kMillisecond = 1'000'000;
constexpr std::size_t kPlenty = 1 << 30;
// A ring forgets this much at once.
constexpr std::size_t kBlock = 64 << 10;

std::string wake(std::uint64_t time, std::int32_t tid) {
  cie_sched_wake event{};
  event.header = {.id = CIE_SCHED_WAKING, .time = time};
  event.task.thread.tid = tid;
  return {reinterpret_cast<const char*>(&event), sizeof event};
}

struct Collected final : KernelEventSink {
  struct Loss {
    std::uint64_t time = 0;
    std::uint64_t total = 0;
    std::size_t events_before = 0;
    bool operator==(const Loss&) const = default;
  };
  void on_event(std::uint64_t time, std::string_view event) override {
    times.push_back(time);
    events.emplace_back(event);
  }
  void on_loss(std::uint64_t time, std::uint64_t total) override {
    losses.push_back({time, total, events.size()});
  }
  std::vector<std::uint64_t> times;
  std::vector<std::string> events;
  std::vector<Loss> losses;
};

Collected replayed(const KernelRing& ring) {
  Collected collected;
  ring.replay(collected);
  return collected;
}

// An event every millisecond, numbered by its thread id.
void fill(KernelRing& ring, std::uint64_t from, std::uint64_t count) {
  for (std::uint64_t i = from; i < from + count; ++i) {
    ring.on_event(i * kMillisecond, wake(i * kMillisecond, static_cast<std::int32_t>(i)));
  }
}

// All from the first one kept to the last one that came, and none twice.
void expect_the_last(const Collected& kept, std::uint64_t count) {
  ASSERT_FALSE(kept.times.empty());
  const std::uint64_t first = kept.times.front() / kMillisecond;
  ASSERT_EQ(kept.times.size(), count - first);
  for (std::uint64_t i = first; i < count; ++i) {
    ASSERT_EQ(kept.events[i - first], wake(i * kMillisecond, static_cast<std::int32_t>(i)));
  }
}

TEST(KernelRing, GivesBackWhatCame) {
  KernelRing ring(1s, kPlenty, 7);
  ring.on_event(10, wake(10, 1));
  ring.on_event(20, wake(20, 2));
  ring.on_loss(30, 5);
  ring.on_event(30, wake(30, 3));
  const Collected kept = replayed(ring);
  EXPECT_EQ(kept.events, (std::vector<std::string>{wake(10, 1), wake(20, 2), wake(30, 3)}));
  EXPECT_EQ(kept.times, (std::vector<std::uint64_t>{10, 20, 30}));
  EXPECT_EQ(kept.losses,
            (std::vector<Collected::Loss>{{.time = 30, .total = 5, .events_before = 2}}));
  EXPECT_EQ(ring.begin(), 7U);
  EXPECT_EQ(replayed(ring).events, kept.events) << "it keeps them";
}

TEST(KernelRing, ForgetsWhatIsOlderThanItsLength) {
  constexpr std::uint64_t kCount = 20'000;
  KernelRing ring(1s, kPlenty, 0);
  fill(ring, 0, kCount);
  const Collected kept = replayed(ring);
  expect_the_last(kept, kCount);
  EXPECT_GE(kept.times.size(), 1000U) << "the last second";
  EXPECT_LE(kept.times.size(), 1000 + 2 * kBlock / wake(0, 0).size());
  // Nothing is missing from the begin on: it is the time of the last one forgotten.
  EXPECT_EQ(ring.begin(), kept.times.front() - kMillisecond);
}

TEST(KernelRing, KeepsToItsMemory) {
  constexpr std::uint64_t kCount = 50'000;
  constexpr std::size_t kMost = 5 * kBlock;
  KernelRing ring(1h, kMost, 0);
  fill(ring, 0, kCount);
  const Collected kept = replayed(ring);
  expect_the_last(kept, kCount);
  const std::size_t bytes = kept.events.size() * wake(0, 0).size();
  EXPECT_LE(bytes, kMost + kBlock);
  EXPECT_GE(bytes, kMost - kBlock);
}

TEST(KernelRing, CountsLossesFromWhereItBegins) {
  KernelRing ring(1s, kPlenty, 0);
  ring.on_loss(0, 5);
  fill(ring, 0, 10'000);
  EXPECT_TRUE(replayed(ring).losses.empty()) << "it was before the begin";
  ring.on_loss(10'000 * kMillisecond, 12);
  fill(ring, 10'000, 1);
  const Collected kept = replayed(ring);
  ASSERT_EQ(kept.losses.size(), 1U);
  EXPECT_EQ(kept.losses[0].total, 12U - 5U);
  EXPECT_EQ(ring.lost_since_begin(15), 15U - 5U);
}

}  // namespace
}  // namespace cie::record
