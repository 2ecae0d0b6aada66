#include "scheduling/arrival_log.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <limits>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie::scheduling {
namespace {

TEST(ArrivalLog, FindsWhatWasRecorded) {
  ArrivalLog log{1};
  const std::array<char, 3> samples{};
  for (int i = 0; i < 3; ++i) {
    log.record(&samples[static_cast<std::size_t>(i)], {.time_ns = 10 + i, .writer_gid = 100});
  }
  const auto arrival = log.find(&samples[1]);
  ASSERT_TRUE(arrival);
  EXPECT_EQ(arrival->time_ns, 11);
  EXPECT_EQ(arrival->writer_gid, 100U);
}

TEST(ArrivalLog, DoesNotKnowWhatItNeverSaw) {
  ArrivalLog log{1};
  const char sample = 0;
  EXPECT_FALSE(log.find(&sample));
}

// Memory of a sample that was freed comes back for another one.
TEST(ArrivalLog, PrefersTheNewestOfAnAddress) {
  ArrivalLog log{1};
  const char sample = 0;
  log.record(&sample, {.time_ns = 1, .writer_gid = 1});
  log.record(&sample, {.time_ns = 2, .writer_gid = 2});
  EXPECT_EQ(log.find(&sample)->time_ns, 2);
}

TEST(ArrivalLog, ForgetsTheOldestNeverTheOnesInTheQueue) {
  constexpr std::size_t kDepth = 100;
  ArrivalLog log{kDepth};
  std::array<char, 10000> samples{};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    log.record(&samples[i], {.time_ns = static_cast<std::int64_t>(i), .writer_gid = 0});
  }
  for (std::size_t i = samples.size() - kDepth; i < samples.size(); ++i) {
    ASSERT_TRUE(log.find(&samples[i]));
    EXPECT_EQ(log.find(&samples[i])->time_ns, static_cast<std::int64_t>(i));
  }
  EXPECT_FALSE(log.find(&samples[0]));
}

std::int64_t processor_ns() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * std::int64_t{1'000'000'000} + time.tv_nsec;
}

// Of taking so many samples out of a full queue, the oldest first: the least of several.
std::int64_t cost_of_taking(std::size_t samples, std::size_t depth) {
  ArrivalLog log{depth};
  std::vector<std::max_align_t> memory(depth);
  for (const auto& sample : memory)
    log.record(&sample, {.time_ns = 1, .writer_gid = 1});
  auto least = std::numeric_limits<std::int64_t>::max();
  for (int round = 0; round < 5; ++round) {
    std::size_t found = 0;
    const std::int64_t begin = processor_ns();
    for (std::size_t i = 0; i < samples; ++i)
      found += log.find(&memory[i % depth]) ? 1U : 0U;
    least = std::min(least, processor_ns() - begin);
    EXPECT_EQ(found, samples);
  }
  return least;
}

// Caches make of the same work some two to four times as much; of a search through the queue, the
// factor is the queues' own: 128.
TEST(ArrivalLog, CostsTheSameHoweverManySamplesWait) {
  constexpr std::size_t kDeep = 4096;
  constexpr std::size_t kShort = kDeep / 128;
  EXPECT_LE(cost_of_taking(kDeep, kDeep), cost_of_taking(kDeep, kShort) * 16);
}

// A lookup that races with the recorder finds the right arrival or none, never a torn one.
TEST(ArrivalLog, NeverTearsAnEntry) {
  ArrivalLog log{1};
  std::array<char, 64> samples{};
  std::atomic<bool> is_done{false};
  std::thread recorder{[&] {
    for (std::int64_t i = 0; i < 200000; ++i) {
      const auto index = static_cast<std::size_t>(i) % samples.size();
      log.record(&samples[index], {.time_ns = i, .writer_gid = static_cast<std::uint64_t>(i)});
    }
    is_done = true;
  }};
  while (!is_done) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (const auto arrival = log.find(&samples[i])) {
        EXPECT_EQ(arrival->writer_gid, static_cast<std::uint64_t>(arrival->time_ns));
        EXPECT_EQ(static_cast<std::size_t>(arrival->time_ns) % samples.size(), i);
      }
    }
  }
  recorder.join();
}

}  // namespace
}  // namespace cie::scheduling
