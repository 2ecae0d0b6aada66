// Which streams of a channel must be left out for the others to have a time in common.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <ctf/stream/coverage.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using testing::ElementsAre;

std::vector<TimeWindow> windows(const std::vector<std::pair<std::int64_t, std::int64_t>>& times) {
  std::vector<TimeWindow> result;
  for (const auto& [from, to] : times)
    result.push_back({.from = {from}, .to = {to}});
  return result;
}

TEST(LeftOut, NoneWhereAllHaveAPointInCommon) {
  const auto result = left_out(windows({{0, 10}, {5, 20}, {10, 30}}));
  EXPECT_THAT(result.streams, ElementsAre(false, false, false));
  EXPECT_EQ(result.common, windows({{10, 10}}).front());
}

TEST(LeftOut, AreTheFewest) {
  const auto result = left_out(windows({{50, 60}, {0, 10}, {2, 9}, {100, 900}}));
  EXPECT_THAT(result.streams, ElementsAre(true, false, false, true));
  EXPECT_EQ(result.common, windows({{2, 9}}).front());
}

TEST(LeftOut, AmongEqualsTheLongerTimeStays) {
  EXPECT_THAT(left_out(windows({{0, 10}, {20, 31}})).streams, ElementsAre(true, false));
  EXPECT_THAT(left_out(windows({{20, 30}, {0, 10}})).streams, ElementsAre(true, false));
}

// Against every set of streams.
TEST(LeftOut, IsTheBestOfAllSets) {
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    std::vector<TimeWindow> streams(1 + random() % 7);
    for (auto& stream : streams) {
      stream.from.ns = static_cast<std::int64_t>(random() % 40);
      stream.to.ns = stream.from.ns + static_cast<std::int64_t>(random() % 20);
    }
    std::pair<std::size_t, std::int64_t> best;
    for (unsigned set = 1; set < 1U << streams.size(); ++set) {
      TimeWindow common{};
      std::size_t size = 0;
      for (std::size_t i = 0; i < streams.size(); ++i) {
        if ((set >> i & 1U) == 0) continue;
        ++size;
        common.from = std::max(common.from, streams[i].from);
        common.to = std::min(common.to, streams[i].to);
      }
      if (common.from <= common.to) best = std::max(best, {size, (common.to - common.from).ns});
    }
    const auto result = left_out(streams);
    const auto kept = static_cast<std::size_t>(std::ranges::count(result.streams, false));
    EXPECT_EQ(std::pair(kept, (result.common.to - result.common.from).ns), best) << round;
  }
}

}  // namespace
}  // namespace cie::analysis::ctf
