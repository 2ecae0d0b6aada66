// Count, sum and extremes of a quantity, exact, and its quantiles, approximate within a stated
// bound.
#pragma once

#include <cie/analysis/rare.hpp>
#include <cie/analysis/time.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace cie::analysis {

// Values that a histogram does not tell apart, by the one that stands for them.
struct HistogramBucket {
  std::int64_t value = 0;
  std::uint64_t count = 0;
  // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
  friend auto operator<=>(const HistogramBucket&, const HistogramBucket&) = default;
};

// The least and the greatest value.
struct ValueRange {
  std::int64_t least = 0;
  std::int64_t greatest = 0;
};
// The values that a histogram does not tell apart from this one.
ValueRange values_like(std::int64_t value) noexcept;

// The numbers printed for a quantity (`S` of the report): integers in nanoseconds.
struct Summary {
  std::uint64_t count = 0;
  std::int64_t min = 0;
  std::int64_t max = 0;
  std::int64_t sum = 0;  // saturates at the ends of int64
  double mean = 0;
  std::int64_t p50 = 0;
  std::int64_t p90 = 0;
  std::int64_t p99 = 0;
  std::int64_t p99_9 = 0;
  // What the quantiles come from, ascending; empty unless asked for. Not part of the JSON.
  std::vector<HistogramBucket> buckets{};
};

// A log-linear histogram: 64 sub-buckets per octave, so a value is known within 1/128 of itself
// (0.8 %) and values below 128 exactly. Negative values are kept by magnitude. Mergeable: adding
// two histograms equals one histogram of all values. Memory: up to 32 values, 64 bytes; then those
// per quarter of an octave that a value fell into, and one for each between the least and the
// largest value; at most 30 KB.
class LogLinearHistogram {
 public:
  void add(std::int64_t value) { add(std::span(&value, 1)); }
  void add(std::span<const std::int64_t> values);
  void merge(const LogLinearHistogram& other);
  // Nearest rank ceil(p * count) with p = numerator/denominator; the bucket's midpoint. Requires
  // count() > 0.
  std::int64_t quantile(std::uint64_t numerator, std::uint64_t denominator) const;
  // That rank, of 1 to count().
  std::uint64_t rank(std::uint64_t numerator, std::uint64_t denominator) const;
  // The values of ranks that ascend, in one walk over the buckets.
  void at_ranks(std::span<const std::uint64_t> ranks, std::span<std::int64_t> values) const;
  std::uint64_t count() const noexcept { return count_; }
  // Those that hold something, ascending. Adding up the counts of equal values of several
  // histograms gives the buckets of their sum, and so its quantiles.
  std::vector<HistogramBucket> buckets() const;

 private:
  // How many values fell into each bucket. Most quantities vary little, so counters come in blocks;
  // a large system has many of which there are few values, and as long as a block has room for the
  // values themselves there are no counters.
  class Counters {
   public:
    void add(std::size_t bucket) {
      auto near = bucket / kBlock - first_block_;  // very large if it lies before
      if (near >= places_.size() || places_[near] == 0) [[unlikely]] {
        if (has_room_for(1)) return keep(bucket);
        if (few_count_ > 0) count_few();
        near = add_block(bucket / kBlock);
      }
      auto& count = counts_[(places_[near] - std::size_t{1}) * kBlock + bucket % kBlock];
      if (++count == 0) [[unlikely]]
        carry(bucket);
    }
    // Of several values the same.
    void add(std::span<const std::uint32_t> values);
    // Whether that many need no counters.
    bool has_room_for(std::size_t values) const noexcept {
      return places_.empty() && few_count_ + values <= kFew;
    }
    // After has_room_for().
    void keep(std::size_t bucket) noexcept {
      few_[few_count_++] = static_cast<std::uint16_t>(bucket);
    }
    void merge(const Counters& other);
    // `visit` takes a bucket that holds something and how much, ascending, and says whether it wants
    // more.
    template <typename Visit>
    void each(const Visit& visit) const {
      each_few(visit);
      for (std::size_t near = 0; near < places_.size(); ++near) {
        if (places_[near] == 0) continue;
        const auto* counts = &counts_[(places_[near] - std::size_t{1}) * kBlock];
        for (std::size_t i = 0; i < kBlock; ++i) {
          const auto bucket = (first_block_ + near) * kBlock + i;
          const auto count = counts[i] + (carries_ ? carried(bucket) : 0);
          if (count > 0 && !visit(bucket, count)) return;
        }
      }
    }

   private:
    static constexpr std::size_t kBlock = 16;
    static constexpr std::size_t kFew = 32;
    template <typename Visit>
    void each_few(const Visit& visit) const {
      auto sorted = few_;
      const auto* const end = sorted.data() + few_count_;
      std::sort(sorted.data(), sorted.data() + few_count_);
      for (const auto* at = sorted.data(); at != end;) {
        const auto* const first = at;
        while (at != end && *at == *first)
          ++at;
        if (!visit(std::size_t{*first}, static_cast<std::uint64_t>(at - first))) return;
      }
    }
    void count_few();  // from now on by counters
    // Returns where in `places_` it is; it may be there already.
    std::size_t add_block(std::size_t block);
    void carry(std::size_t bucket);
    std::uint64_t carried(std::size_t bucket) const noexcept;

    // The bucket of each value, as long as there are no counters.
    std::array<std::uint16_t, kFew> few_{};
    std::uint32_t few_count_ = 0;
    // From the first block that holds something to the last, where its counters are, from 1; 0:
    // nowhere yet. Of 64 bits there are 236 blocks.
    std::vector<std::uint8_t> places_;
    std::size_t first_block_ = 0;
    std::vector<std::uint32_t> counts_;  // there are many, and most stay small
    // Buckets, once for each time that their count ran over.
    Rare<std::vector<std::uint32_t>> carries_;
  };

  friend class Statistics;
  void add(std::span<const std::uint32_t> values);
  template <typename Visit>
  void each(const Visit& visit) const;

  Counters positive_;
  Rare<Counters> negative_;  // by magnitude
  std::uint64_t count_ = 0;
};

__extension__ typedef __int128
    Int128;  // NOLINT(modernize-use-using): the only spelling -Wpedantic takes

// Accumulates one quantity. Not thread-safe, not even for reading; merge per-shard objects instead.
// Takes two words until the first value: most quantities of most callbacks are never measured.
class Statistics {
 public:
  Statistics() noexcept = default;
  Statistics(const Statistics&) = default;
  Statistics(Statistics&& other) noexcept
      : values_(std::move(other.values_)), room_(std::exchange(other.room_, 0)) {}
  Statistics& operator=(const Statistics&) = default;
  Statistics& operator=(Statistics&& other) noexcept {
    values_ = std::move(other.values_);
    room_ = std::exchange(other.room_, 0);
    return *this;
  }
  ~Statistics() = default;

  [[gnu::always_inline]] void add(Duration value) {
    const auto small = static_cast<std::uint32_t>(value.ns);
    if (small != value.ns) [[unlikely]] {
      take(value.ns);
      return;
    }
    if (room_ == 0) [[unlikely]]
      make_room();
    values_->waiting[kWaiting - room_--] = small;
  }
  // A value will be added soon: brings what add() writes into the cache.
  void prefetch() const noexcept {
    if (room_ > 0) __builtin_prefetch(&values_->waiting[kWaiting - room_], 1);
  }
  void merge(const Statistics& other);
  std::uint64_t count() const noexcept {
    if (!values_) return 0;
    return kWaiting - room_ + (values_->settled ? values_->settled->histogram.count() : 0);
  }
  // The rank-th smallest value, 1 <= rank <= count(), within the histogram's bound.
  std::int64_t at_rank(std::uint64_t rank) const;
  // Between which values that one lies, for certain.
  ValueRange range_at_rank(std::uint64_t rank) const;
  // Empty when nothing was added: "not measured" is never 0.
  std::optional<Summary> summary(bool with_buckets = false) const;

 private:
  struct Settled {
    template <typename Integer>
    void take(std::span<const Integer> values);

    LogLinearHistogram histogram;
    std::int64_t min = 0;
    std::int64_t max = 0;
    Int128 sum = 0;
  };
  // Values wait for some more: consecutive ones are of different quantities, and to reach the
  // histogram of each is to wait for memory. Those of up to 4 s do, which nearly all are. A
  // quantity of a large system often has no more of them than fit into two cache lines.
  static constexpr std::size_t kWaiting = 30;
  struct alignas(64) Values {
    static void* operator new(std::size_t size);
    static void operator delete(void* values) noexcept;

    std::array<std::uint32_t, kWaiting> waiting{};
    Rare<Settled> settled{};
  };

  void take(std::int64_t value);
  void make_room();
  Summary summary_of_few() const;  // while all values wait
  std::span<const std::uint32_t> waiting_values() const {
    return std::span(values_->waiting).first(kWaiting - room_);
  }
  // Takes what waits. Changes nothing that can be seen. Requires values, as the next one does.
  Settled& settle() const;
  // The same, but while all of them wait, they do so on, and `scratch` takes them.
  const Settled& all(Settled& scratch) const;

  mutable Rare<Values> values_;     // those that wait may be settled whenever they are asked for
  mutable std::uint32_t room_ = 0;  // how many more may wait there
};

}  // namespace cie::analysis
