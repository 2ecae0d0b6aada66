// Which of several streams stands first on the time line.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {

// A tree of matches that remembers the loser of each (Knuth: The Art of Computer Programming 3,
// 5.4.1): the winner's next key meets one opponent per round. Equal keys go by the streams' order.
class Tournament {
 public:
  explicit Tournament(std::span<const std::int64_t> keys) {
    const auto leaves = std::bit_ceil(std::max<std::size_t>(keys.size(), 1));
    losers_.resize(leaves, kOut);
    std::vector<Player> winners(2 * leaves, kOut);
    for (std::size_t i = 0; i < keys.size(); ++i)
      winners[leaves + i] = player(keys[i], i);
    for (auto match = leaves; --match > 0;) {
      const auto [winner, loser] = std::minmax(winners[2 * match], winners[2 * match + 1]);
      winners[match] = winner;
      losers_[match] = loser;
    }
    winner_ = winners[1];
  }

  bool is_over() const noexcept { return winner_.stream == kOut.stream; }  // all are out
  std::size_t winner() const noexcept { return static_cast<std::size_t>(winner_.stream); }
  // The winner plays on from another place.
  void move_winner(std::int64_t key) noexcept { play(player(key, winner())); }
  // The winner plays no more.
  void remove_winner() noexcept { play(kOut); }

 private:
  struct Player {
    std::uint64_t key = 0;  // biased, so that it compares as unsigned
    std::uint64_t stream = 0;
    // All parts are computed: a comparison that stops early would be a branch.
    bool operator<(const Player& other) const noexcept {
      return static_cast<unsigned>(key < other.key) |
             (static_cast<unsigned>(key == other.key) &
              static_cast<unsigned>(stream < other.stream));
    }
  };
  static constexpr Player kOut{~std::uint64_t{0}, ~std::uint64_t{0}};

  static Player player(std::int64_t key, std::size_t stream) noexcept {
    return {static_cast<std::uint64_t>(key) ^ (std::uint64_t{1} << 63U), stream};
  }
  void play(Player player) noexcept {
    for (auto match = (losers_.size() + winner()) / 2; match > 0; match /= 2) {
      auto& loser = losers_[match];
      // Without a branch: nothing could predict how streams interleave.
      const auto mask = 0 - std::uint64_t{loser < player};
      const Player exchange{(loser.key ^ player.key) & mask, (loser.stream ^ player.stream) & mask};
      loser = {loser.key ^ exchange.key, loser.stream ^ exchange.stream};
      player = {player.key ^ exchange.key, player.stream ^ exchange.stream};
    }
    winner_ = player;
  }

  std::vector<Player> losers_;  // by match; 1 is the final, 0 is unused
  Player winner_ = kOut;
};

}  // namespace cie::analysis::ctf
