#include <cie/analysis/statistics.hpp>

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <type_traits>
#include <utility>

namespace cie::analysis {
namespace {

// Buckets 0..127 hold the values 0..127; from there 64 buckets per octave.
constexpr std::uint64_t kExact = 128;
constexpr unsigned kSubBucketBits = 6;

std::uint64_t magnitude(std::int64_t value) noexcept {
  const auto bits = static_cast<std::uint64_t>(value);
  return value < 0 ? 0 - bits : bits;
}

// kExact + 64 * (shift - 1) + (value >> shift) - 64, where a value of an octave is 64 to 127 when
// shifted; below kExact, where nothing is shifted, the value. Both without a branch.
std::size_t bucket_of(std::uint64_t value) noexcept {
  const auto shift =
      static_cast<unsigned>(std::bit_width(value | (kExact - 1))) - (kSubBucketBits + 1);
  return (std::size_t{shift} << kSubBucketBits) + (value >> shift);
}

// The same for values below 2^31 by what a vector can do: a number's exponent and the six bits
// behind its leading one are those of a float. Of the bits that a float cannot hold, the first is
// cleared, so that none is rounded up.
std::uint32_t bucket_of_small(std::uint32_t value) noexcept {
  constexpr std::int32_t kBias = (127 << kSubBucketBits) + 5 * 64;
  const auto kept = static_cast<std::int32_t>(value & ~(value >> 8U));
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(kept));
  const auto bucket = static_cast<std::int32_t>(bits >> (23 - kSubBucketBits)) - kBias;
  const auto exact = std::min(static_cast<std::int32_t>(value), 63);
  return static_cast<std::uint32_t>(std::max(bucket, exact));
}

// Midpoint of a bucket; the bucket's own value where it holds one.
std::uint64_t value_of(std::size_t bucket) noexcept {
  if (bucket < kExact) return bucket;
  const auto octave = static_cast<unsigned>((bucket - kExact) / 64) + 7;
  const auto sub = (bucket - kExact) % 64;
  const auto shift = octave - kSubBucketBits;
  return ((64 + sub) << shift) + ((std::uint64_t{1} << shift) >> 1U);
}

std::int64_t clamped(Int128 value) noexcept {
  if (value > std::numeric_limits<std::int64_t>::max()) {
    return std::numeric_limits<std::int64_t>::max();
  }
  if (value < std::numeric_limits<std::int64_t>::min()) {
    return std::numeric_limits<std::int64_t>::min();
  }
  return static_cast<std::int64_t>(value);
}

Summary summary_of(std::uint64_t count, std::int64_t min, std::int64_t max, Int128 sum,
                   const std::array<std::int64_t, 4>& quantiles) {
  const auto within = [min, max](std::int64_t quantile) { return std::clamp(quantile, min, max); };
  return {.count = count,
          .min = min,
          .max = max,
          .sum = clamped(sum),
          .mean = static_cast<double>(sum) / static_cast<double>(count),
          .p50 = within(quantiles[0]),
          .p90 = within(quantiles[1]),
          .p99 = within(quantiles[2]),
          .p99_9 = within(quantiles[3])};
}

std::int64_t value_at(const LogLinearHistogram& histogram, std::uint64_t rank) {
  std::int64_t value = 0;
  histogram.at_ranks({&rank, 1}, {&value, 1});
  return value;
}

// ceil(count * numerator / denominator), at least 1.
std::uint64_t rank_of(std::uint64_t count, std::uint64_t numerator, std::uint64_t denominator) {
  assert(count > 0 && numerator <= denominator);
  if ((count | denominator) >> 32U == 0) [[likely]] {  // a division of 128 bits takes long
    return std::max<std::uint64_t>(1, (count * numerator + denominator - 1) / denominator);
  }
  const auto product = static_cast<Int128>(count) * numerator;
  return std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>((product + denominator - 1) / denominator));
}

// Those of a summary's quantiles.
std::array<std::uint64_t, 4> quantile_ranks(std::uint64_t count) {
  return {rank_of(count, 50, 100), rank_of(count, 90, 100), rank_of(count, 99, 100),
          rank_of(count, 999, 1000)};
}

// In order; none is negative as a signed number. How many are below a value is its place, and those that
// equal it come behind: without a branch, of which std::sort guesses every third one wrongly, in a sixth
// of its time.
template <typename Number, std::size_t kMost>
std::array<Number, kMost> sorted(const std::array<Number, kMost>& values, std::size_t count) {
  using Signed = std::make_signed_t<Number>;  // which is what vectors compare
  std::array<Signed, kMost> all;              // NOLINT(cppcoreguidelines-pro-type-member-init)
  for (std::size_t i = 0; i < kMost; ++i) {
    all[i] = i < count ? static_cast<Signed>(values[i]) : std::numeric_limits<Signed>::max();
  }
  std::array<Number, kMost> ordered{};
  for (std::size_t i = 0; i < count; ++i) {
    Signed below = 0;
    for (const auto other : all)
      below = static_cast<Signed>(below + (other < all[i] ? 1 : 0));
    ordered[static_cast<std::size_t>(below)] = values[i];
  }
  for (std::size_t i = 1; i < count; ++i)
    ordered[i] = std::max(ordered[i], ordered[i - 1]);
  return ordered;
}

}  // namespace

std::array<std::uint16_t, LogLinearHistogram::Counters::kFew>
LogLinearHistogram::Counters::sorted_few() const {
  return sorted(few_, few_count_);
}

ValueRange values_like(std::int64_t value) noexcept {
  const auto bucket = bucket_of(magnitude(value));
  if (bucket < kExact) return {.least = value, .greatest = value};
  const auto shift = (bucket - kExact) / 64 + 7 - kSubBucketBits;
  const auto width = Int128{1} << shift;
  const auto least = (Int128{magnitude(value)} >> shift) << shift;
  const auto greatest = least + width - 1;
  return value < 0 ? ValueRange{.least = clamped(-greatest), .greatest = clamped(-least)}
                   : ValueRange{.least = clamped(least), .greatest = clamped(greatest)};
}

// Apart from what it grows, so that counting needs no register saved.
[[gnu::noinline]] void LogLinearHistogram::Counters::add_block(std::size_t block) {
  if (has_block(block)) return;
  if (offsets_.empty()) first_block_ = block;
  if (block < first_block_) {
    offsets_.insert(offsets_.begin(), first_block_ - block, kNowhere);
    first_block_ = block;
  }
  const auto near = block - first_block_;
  if (near >= offsets_.size()) {
    offsets_.reserve(near + 1);  // no more: there are many histograms
    offsets_.resize(near + 1, kNowhere);
  }
  offsets_[near] = static_cast<std::int16_t>(counts_.size() - block * kBlock);
  // By a quarter: most have few.
  const auto size = counts_.size() + kBlock;
  if (size > counts_.capacity()) counts_.reserve(size + counts_.size() / 4);
  counts_.resize(size);
}

void LogLinearHistogram::Counters::count_few() {
  const std::span few(few_.data(), std::exchange(few_count_, 0));
  add_block(few.front() / kBlock);
  for (const auto bucket : few)
    add(bucket);
}

void LogLinearHistogram::Counters::carry(std::size_t bucket) {
  if (!carries_) carries_.emplace();
  carries_->push_back(static_cast<std::uint32_t>(bucket));
}

void LogLinearHistogram::Counters::merge(const Counters& other) {
  for (const auto bucket : std::span(other.few_.data(), other.few_count_))
    add(bucket);
  if (other.offsets_.empty()) return;
  if (few_count_ > 0) count_few();
  for (std::size_t near = 0; near < other.offsets_.size(); ++near) {
    if (other.offsets_[near] == kNowhere) continue;
    const auto first = (other.first_block_ + near) * kBlock;
    add_block(first / kBlock);
    for (auto bucket = first; bucket < first + kBlock; ++bucket) {
      const auto theirs = other.counts_[bucket + other.offset_of(bucket)];
      auto& ours = counts_[bucket + offset_of(bucket)];
      ours += theirs;
      if (ours < theirs) carry(bucket);
    }
  }
  if (!other.carries_) return;
  for (const auto bucket : *other.carries_)
    carry(bucket);
}

std::uint64_t LogLinearHistogram::Counters::carried(std::size_t bucket) const noexcept {
  if (!carries_) return 0;
  return static_cast<std::uint64_t>(std::ranges::count(*carries_, bucket)) << 32U;
}

bool LogLinearHistogram::Counters::has_blocks(std::size_t first, std::size_t last) const noexcept {
  const auto begin = first - first_block_;  // very large if it lies before
  const auto end = last - first_block_ + 1;
  if (begin >= end || end > offsets_.size()) return false;
  const std::span blocks(offsets_);
  return std::ranges::count(blocks.subspan(begin, end - begin), kNowhere) == 0;
}

void LogLinearHistogram::Counters::add(std::span<const std::uint32_t> buckets, std::size_t least,
                                       std::size_t greatest) {
  if (!has_blocks(least / kBlock, greatest / kBlock)) {
    for (const auto bucket : buckets)
      add(bucket);
    return;
  }
  // Where counters are stays in registers.
  const auto* const offsets = offsets_.data();
  const auto first = first_block_;
  auto* const counts = counts_.data();
  for (const std::size_t bucket : buckets) {
    const auto offset = std::ptrdiff_t{offsets[bucket / kBlock - first]};
    if (++counts[bucket + static_cast<std::size_t>(offset)] == 0) [[unlikely]]
      carry(bucket);
  }
}

template <std::size_t kExtent>
void LogLinearHistogram::add(std::span<const std::uint32_t, kExtent> values, std::uint32_t least,
                             std::uint32_t greatest) {
  count_ += values.size();
  if constexpr (kExtent == std::dynamic_extent) {
    for (const auto value : values)
      positive_.add(bucket_of(value));
  } else {
    std::array<std::uint32_t, kExtent> buckets;  // NOLINT(cppcoreguidelines-pro-type-member-init)
    for (std::size_t i = 0; i < kExtent; ++i)
      buckets[i] = bucket_of_small(values[i]);
    positive_.add(buckets, bucket_of(least), bucket_of(greatest));
  }
}

void LogLinearHistogram::add(std::span<const std::int64_t> values) {
  for (const auto value : values) {
    if (value >= 0) [[likely]] {
      positive_.add(bucket_of(static_cast<std::uint64_t>(value)));
    } else {
      if (!negative_) negative_.emplace();
      negative_->add(bucket_of(magnitude(value)));
    }
  }
  count_ += values.size();
}

void LogLinearHistogram::merge(const LogLinearHistogram& other) {
  positive_.merge(other.positive_);
  if (other.negative_) {
    if (!negative_) negative_.emplace();
    negative_->merge(*other.negative_);
  }
  count_ += other.count_;
}

// `visit` takes a value and how many there are, ascending, and says whether it wants more.
template <typename Visit>
void LogLinearHistogram::each(const Visit& visit) const {
  if (negative_) {
    std::vector<std::pair<std::size_t, std::uint64_t>> counts;
    negative_->each([&counts](std::size_t bucket, std::uint64_t count) {
      counts.emplace_back(bucket, count);
      return true;
    });
    std::ranges::reverse(counts);  // the largest magnitude first
    for (const auto& [bucket, count] : counts) {
      if (!visit(static_cast<std::int64_t>(0 - value_of(bucket)), count)) return;
    }
  }
  positive_.each([&visit](std::size_t bucket, std::uint64_t count) {
    return visit(static_cast<std::int64_t>(value_of(bucket)), count);
  });
}

void LogLinearHistogram::at_ranks(std::span<const std::uint64_t> ranks,
                                  std::span<std::int64_t> values) const {
  assert(ranks.size() == values.size() && std::ranges::is_sorted(ranks));
  std::size_t next = 0;
  std::uint64_t seen = 0;
  each([&](std::int64_t value, std::uint64_t count) {
    seen += count;
    for (; next < ranks.size() && seen >= ranks[next]; ++next)
      values[next] = value;
    return next < ranks.size();
  });
}

std::uint64_t LogLinearHistogram::rank(std::uint64_t numerator, std::uint64_t denominator) const {
  return rank_of(count_, numerator, denominator);
}

std::int64_t LogLinearHistogram::quantile(std::uint64_t numerator,
                                          std::uint64_t denominator) const {
  return value_at(*this, rank(numerator, denominator));
}

std::vector<HistogramBucket> LogLinearHistogram::buckets() const {
  std::vector<HistogramBucket> all;
  each([&all](std::int64_t value, std::uint64_t count) {
    all.push_back({.value = value, .count = count});
    return true;
  });
  return all;
}

template <typename Integer, std::size_t kExtent>
void Statistics::Settled::take(std::span<const Integer, kExtent> values) {
  if (values.empty()) return;
  const bool is_first = histogram.count() == 0;
  // Those of 32 bits are below 2^31, and few enough for a sum of 64.
  constexpr bool kSmall = std::is_same_v<Integer, std::uint32_t>;
  using Signed = std::make_signed_t<Integer>;
  auto least = static_cast<Signed>(values[0]);
  auto most = least;
  std::conditional_t<kSmall, std::uint64_t, Int128> total = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    least = std::min(least, static_cast<Signed>(values[i]));
    most = std::max(most, static_cast<Signed>(values[i]));
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    total += values[i];
  if constexpr (kSmall) {
    histogram.add(values, static_cast<Integer>(least), static_cast<Integer>(most));
  } else {
    histogram.add(values);
  }
  min = is_first ? least : std::min<std::int64_t>(min, least);
  max = is_first ? most : std::max<std::int64_t>(max, most);
  sum += total;
}

void Statistics::take(std::int64_t value) {
  if (!values_) make_room();
  settle().take(std::span<const std::int64_t>(&value, 1));
}

void Statistics::make_room() {
  if (values_) {
    settle();
  } else {
    values_.emplace();
    room_ = kWaiting;
  }
}

Statistics::Settled& Statistics::settle() const {
  auto& settled = values_->settled;
  if (!settled) settled.emplace();
  if (room_ == 0) {
    settled->take(std::span(std::as_const(values_->waiting)));
  } else {
    settled->take(waiting_values());
  }
  room_ = kWaiting;
  return *settled;
}

const Statistics::Settled& Statistics::all(Settled& scratch) const {
  if (values_->settled) return settle();
  scratch.take(waiting_values());
  return scratch;
}

void Statistics::merge(const Statistics& other) {
  if (!other.values_) return;
  if (!values_) {
    *this = other;
    return;
  }
  const auto& theirs = other.settle();
  auto& ours = settle();
  ours.min = std::min(ours.min, theirs.min);
  ours.max = std::max(ours.max, theirs.max);
  ours.sum += theirs.sum;
  ours.histogram.merge(theirs.histogram);
}

std::int64_t Statistics::at_rank(std::uint64_t rank) const {
  if (!values_) return 0;
  Settled scratch;
  const auto& all = this->all(scratch);
  return std::clamp(value_at(all.histogram, rank), all.min, all.max);
}

ValueRange Statistics::range_at_rank(std::uint64_t rank) const {
  if (!values_) return {};
  Settled scratch;
  const auto& all = this->all(scratch);
  const auto [least, greatest] = values_like(value_at(all.histogram, rank));
  return {.least = std::max(least, all.min), .greatest = std::min(greatest, all.max)};
}

Rare<Summary> Statistics::summary(bool with_buckets) const {
  if (!values_) return std::nullopt;
  if (!values_->settled && !with_buckets) return summary_of_few();
  Settled scratch;
  const auto& all = this->all(scratch);
  const auto& histogram = all.histogram;
  std::array<std::int64_t, 4> quantiles{};
  if (all.min < all.max) histogram.at_ranks(quantile_ranks(histogram.count()), quantiles);
  auto summary = summary_of(histogram.count(), all.min, all.max, all.sum, quantiles);
  if (with_buckets) summary.buckets = histogram.buckets();
  return summary;
}

// The same numbers as the histogram would give.
Summary Statistics::summary_of_few() const {
  const auto values = sorted(values_->waiting, waiting_values().size());
  const auto few = std::span(values).first(waiting_values().size());
  std::uint64_t sum = 0;
  for (const auto value : few)
    sum += value;
  std::array<std::int64_t, 4> quantiles{};
  std::ranges::transform(quantile_ranks(few.size()), quantiles.begin(), [few](std::uint64_t rank) {
    return static_cast<std::int64_t>(value_of(bucket_of(few[rank - 1])));
  });
  return summary_of(few.size(), few.front(), few.back(), sum, quantiles);
}

}  // namespace cie::analysis
