// Which of several streams stands first on the time line.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

namespace cie::analysis::ctf {

// A tree of matches that remembers the loser of each (Knuth: The Art of Computer Programming 3,
// 5.4.1): the winner's next key meets one opponent per round. Equal keys go by the streams' order.
// Keys of a stream must not decrease.
//
// A player is one number, so that a match is a minimum and a maximum without a branch: nothing
// could predict how streams interleave. Its upper bits are the key's distance from a base, as far
// as there is room; its lower bits the stream. Should one win that is farther away, the base moves.
class Tournament {
 public:
  explicit Tournament(std::span<const std::int64_t> keys)
      : keys_(keys.begin(), keys.end()),
        next_(keys.size()),
        is_out_(keys.size(), false),
        stream_bits_(static_cast<unsigned>(std::bit_width(keys.size()))),
        stream_mask_((std::uint64_t{1} << stream_bits_) - 1),
        farthest_((~std::uint64_t{0} >> stream_bits_) - 1),
        out_of_reach_(farthest_ << stream_bits_),
        leaves_(std::bit_ceil(std::max<std::size_t>(keys.size(), 1))),
        losers_(leaves_) {
    play_all();
  }

  bool is_over() const noexcept { return winner_ == kOut; }  // all are out
  std::size_t winner() const noexcept { return static_cast<std::size_t>(winner_ & stream_mask_); }
  // Where a stream plays on from when it has won: told early, this does not keep the match waiting.
  void prepare(std::size_t stream, std::int64_t key) noexcept {
    next_[stream] = {.player = player(stream, key), .key = key};
  }
  // The winner plays on from there.
  void move_winner() {
    const auto stream = winner();
    const auto& [player, key] = next_[stream];
    keys_[stream] = key;
    play(stream, player);
  }
  // The winner plays on from another place.
  void move_winner(std::int64_t key) {
    prepare(winner(), key);
    move_winner();
  }
  // The winner plays no more.
  void remove_winner() {
    const auto stream = winner();
    is_out_[stream] = true;
    play(stream, kOut);
  }

 private:
  static constexpr std::uint64_t kOut = ~std::uint64_t{0};

  std::uint64_t player(std::size_t stream, std::int64_t key) const noexcept {
    const auto distance = static_cast<std::uint64_t>(key) - static_cast<std::uint64_t>(base_);
    return std::min(distance, farthest_) << stream_bits_ | stream;
  }
  void play(std::size_t stream, std::uint64_t player) {
    auto* const losers = losers_.data();
    for (auto match = (leaves_ + stream) / 2; match > 0; match /= 2) {
      const auto opponent = losers[match];
      // What compilers make of std::min and std::max of the two is a branch, of one alone is none.
      const auto both = opponent + player;
      player = std::min(opponent, player);
      losers[match] = both - player;
    }
    winner_ = player;
    if (player >= out_of_reach_) [[unlikely]]
      play_all();
  }
  // From the start, with the smallest key as the base.
  void play_all() {
    base_ = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (!is_out_[i]) base_ = std::min(base_, keys_[i]);
    }
    std::vector<std::uint64_t> winners(2 * leaves_, kOut);
    for (std::size_t i = 0; i < keys_.size(); ++i) {
      if (!is_out_[i]) winners[leaves_ + i] = player(i, keys_[i]);
    }
    for (auto match = leaves_; --match > 0;) {
      std::tie(winners[match], losers_[match]) =
          std::minmax(winners[2 * match], winners[2 * match + 1]);
    }
    for (std::size_t i = 0; i < next_.size(); ++i)
      prepare(i, next_[i].key);
    winner_ = winners[1];
  }

  struct Next {
    std::uint64_t player = kOut;
    std::int64_t key = 0;
  };

  std::vector<std::int64_t> keys_;  // by stream
  std::vector<Next> next_;          // by stream: where they play on from when they have won
  std::vector<bool> is_out_;
  unsigned stream_bits_;
  std::uint64_t stream_mask_;
  std::uint64_t farthest_;             // distance that stands for all that are as far or farther
  std::uint64_t out_of_reach_;         // the least player at that distance
  std::size_t leaves_;                 // of the tree, some of which are no stream
  std::vector<std::uint64_t> losers_;  // by match; 1 is the final, 0 is unused
  std::uint64_t winner_ = kOut;
  std::int64_t base_ = 0;
};

}  // namespace cie::analysis::ctf
