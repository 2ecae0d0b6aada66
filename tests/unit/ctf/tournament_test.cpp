// The merge's order: by key, then by stream.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include <ctf/stream/tournament.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

constexpr auto kMin = std::numeric_limits<std::int64_t>::min();
constexpr auto kMax = std::numeric_limits<std::int64_t>::max();

TEST(Tournament, WithoutPlayersIsOver) { EXPECT_TRUE(Tournament({}).is_over()); }

TEST(Tournament, OfOneLastsUntilItLeaves) {
  const std::vector<std::int64_t> keys{kMax};
  Tournament tournament(keys);
  EXPECT_FALSE(tournament.is_over());
  tournament.move_winner(kMax);
  EXPECT_EQ(tournament.winner(), 0U);
  tournament.remove_winner();
  EXPECT_TRUE(tournament.is_over());
}

TEST(Tournament, EqualKeysGoByStream) {
  const std::vector<std::int64_t> keys{5, kMin, 5, kMin};
  Tournament tournament(keys);
  std::vector<std::size_t> order;
  while (!tournament.is_over()) {
    order.push_back(tournament.winner());
    tournament.remove_winner();
  }
  EXPECT_EQ(order, (std::vector<std::size_t>{1, 3, 0, 2}));
}

TEST(Tournament, KeysMayBeAsFarApartAsTheyCan) {
  const std::vector<std::int64_t> keys{kMin, 0, kMin, kMax - 1};
  Tournament tournament(keys);
  std::vector<std::size_t> order;
  const auto move = [&](std::int64_t key) {
    order.push_back(tournament.winner());
    tournament.move_winner(key);
  };
  move(1);     // 0
  move(kMax);  // 2
  move(kMax);  // 1
  move(2);     // 0
  move(kMax);  // 0
  move(kMax);  // 3
  while (!tournament.is_over()) {
    order.push_back(tournament.winner());
    tournament.remove_winner();
  }
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 2, 1, 0, 0, 3, 0, 1, 2, 3}));
}

// Against the smallest (key, stream) found by looking at all of them.
TEST(Tournament, AlwaysNamesTheSmallest) {
  std::mt19937 random(1);
  for (std::size_t streams = 1; streams < 20; ++streams) {
    std::vector<std::int64_t> keys;
    for (std::size_t i = 0; i < streams; ++i)
      keys.push_back(static_cast<std::int64_t>(random() % 10) - 5);
    std::vector<std::size_t> left(streams, 20);  // events of each
    Tournament tournament(keys);
    for (;;) {
      std::pair<std::int64_t, std::size_t> first{kMax, streams};
      for (std::size_t i = 0; i < streams; ++i) {
        if (left[i] > 0) first = std::min(first, {keys[i], i});
      }
      ASSERT_EQ(tournament.is_over(), first.second == streams);
      if (tournament.is_over()) break;
      const auto winner = tournament.winner();
      ASSERT_EQ(winner, first.second);
      keys[winner] += static_cast<std::int64_t>(random() % 4);
      if (--left[winner] == 0) {
        tournament.remove_winner();
      } else {
        tournament.move_winner(keys[winner]);
      }
    }
  }
}

}  // namespace
}  // namespace cie::analysis::ctf
