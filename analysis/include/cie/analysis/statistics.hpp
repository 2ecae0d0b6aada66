// Count, sum and extremes of a quantity, exact, and its quantiles, approximate within a stated
// bound.
#pragma once

#include <cie/analysis/rare.hpp>
#include <cie/analysis/time.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
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
      if (!has_block(bucket / kBlock)) [[unlikely]] {
        if (offsets_.empty() && few_count_ < kFew) {
          few_[few_count_++] = static_cast<std::uint16_t>(bucket);
          return;
        }
        if (few_count_ > 0) count_few();
        add_block(bucket / kBlock);
      }
      if (++counts_[bucket + offset_of(bucket)] == 0) [[unlikely]]
        carry(bucket);
    }
    // Of several buckets, from the least to the greatest one, the same.
    void add(std::span<const std::uint32_t> buckets, std::size_t least, std::size_t greatest);
    void merge(const Counters& other);
    // `visit` takes a bucket that holds something and how much, ascending, and says whether it wants
    // more.
    template <typename Visit>
    void each(const Visit& visit) const {
      each_few(visit);
      for (std::size_t near = 0; near < offsets_.size(); ++near) {
        if (offsets_[near] == kNowhere) continue;
        const auto first = (first_block_ + near) * kBlock;
        for (auto bucket = first; bucket < first + kBlock; ++bucket) {
          const auto count = counts_[bucket + offset_of(bucket)] + (carries_ ? carried(bucket) : 0);
          if (count > 0 && !visit(bucket, count)) return;
        }
      }
    }

   private:
    static constexpr std::size_t kBlock = 16;
    static constexpr std::size_t kFew = 32;
    static constexpr auto kNowhere = std::numeric_limits<std::int16_t>::max();
    template <typename Visit>
    void each_few(const Visit& visit) const {
      const auto sorted = sorted_few();
      const auto* const end = sorted.data() + few_count_;
      for (const auto* at = sorted.data(); at != end;) {
        const auto* const first = at;
        while (at != end && *at == *first)
          ++at;
        if (!visit(std::size_t{*first}, static_cast<std::uint64_t>(at - first))) return;
      }
    }
    std::array<std::uint16_t, kFew> sorted_few() const;
    void count_few();  // from now on by counters
    bool has_block(std::size_t block) const noexcept {
      const auto near = block - first_block_;  // very large if it lies before
      return near < offsets_.size() && offsets_[near] != kNowhere;
    }
    // Each from the first to the last.
    bool has_blocks(std::size_t first, std::size_t last) const noexcept;
    // It may be there already.
    void add_block(std::size_t block);
    // Where its counter is, from the bucket; only where there is one.
    std::size_t offset_of(std::size_t bucket) const noexcept {
      return static_cast<std::size_t>(std::ptrdiff_t{offsets_[bucket / kBlock - first_block_]});
    }
    void carry(std::size_t bucket);
    std::uint64_t carried(std::size_t bucket) const noexcept;

    // The bucket of each value, as long as there are no counters.
    std::array<std::uint16_t, kFew> few_{};
    std::uint32_t few_count_ = 0;
    // From the first block that holds something to the last, how far its counters are from where
    // they were if each block had some. Of 64 bits there are 236 blocks.
    std::vector<std::int16_t> offsets_;
    std::size_t first_block_ = 0;
    std::vector<std::uint32_t> counts_;  // there are many, and most stay small
    // Buckets, once for each time that their count ran over.
    Rare<std::vector<std::uint32_t>> carries_;
  };

  friend class Statistics;
  // Of values below 2^31, of which two are the least and the greatest one.
  template <std::size_t kExtent>
  void add(std::span<const std::uint32_t, kExtent> values, std::uint32_t least,
           std::uint32_t greatest);
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
    if (static_cast<std::uint64_t>(value.ns) > kMostWaiting) [[unlikely]] {
      take(value.ns);
      return;
    }
    if (room_ == 0) [[unlikely]]
      make_room();
    values_->waiting[kWaiting - room_--] = static_cast<std::uint32_t>(value.ns);
  }
  // Where add() writes next. Null: where that is, is not known yet.
  const void* next_place() const noexcept {
    return room_ > 0 ? &values_->waiting[kWaiting - room_] : nullptr;
  }
  // Where the values lie that summary() looks at first. Empty: there are none.
  std::span<const std::byte> memory() const noexcept {
    if (!values_) return {};
    return std::as_bytes(std::span(&*values_, 1));
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
  Rare<Summary> summary(bool with_buckets = false) const;

 private:
  struct Settled {
    template <typename Integer, std::size_t kExtent>
    void take(std::span<const Integer, kExtent> values);

    LogLinearHistogram histogram;
    std::int64_t min = 0;
    std::int64_t max = 0;
    Int128 sum = 0;
  };
  // Values wait for some more: consecutive ones are of different quantities, and to reach the
  // histogram of each is to wait for memory. Those of up to 2 s do, which nearly all are. A
  // quantity of a large system often has no more of them than fit into two cache lines. As many as
  // a few vectors of a processor hold, so that they are taken by vectors.
  static constexpr std::size_t kWaiting = 28;
  static constexpr std::uint64_t kMostWaiting = std::numeric_limits<std::int32_t>::max();
  struct alignas(64) Values {
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
