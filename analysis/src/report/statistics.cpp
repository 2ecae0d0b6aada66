#include <cie/analysis/statistics.hpp>

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

namespace cie::analysis {
namespace {

// Buckets 0..127 hold the values 0..127; from there 64 buckets per octave.
constexpr std::uint64_t kExact = 128;
constexpr unsigned kSubBucketBits = 6;

std::uint64_t magnitude(std::int64_t value) noexcept {
  const auto bits = static_cast<std::uint64_t>(value);
  return value < 0 ? 0 - bits : bits;
}

std::size_t bucket_of(std::uint64_t value) noexcept {
  if (value < kExact) return value;
  const auto octave = static_cast<unsigned>(std::bit_width(value)) - 1;  // >= 7
  const auto sub = (value >> (octave - kSubBucketBits)) & 63U;
  return kExact + std::size_t{64} * (octave - 7) + sub;
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

}  // namespace

// Apart from what it grows, so that counting needs no register saved.
[[gnu::noinline]] void LogLinearHistogram::Counters::add_block(std::size_t block) {
  if (block >= places_.size()) {
    places_.reserve(block + 1);  // no more: there are many histograms
    places_.resize(block + 1);
  }
  // By a quarter: most have few.
  const auto size = counts_.size() + kBlock;
  if (size > counts_.capacity()) counts_.reserve(size + counts_.size() / 4);
  counts_.resize(size);
  places_[block] = static_cast<std::uint8_t>(counts_.size() / kBlock);
}

void LogLinearHistogram::Counters::carry(std::size_t bucket) {
  if (!carries_) carries_.emplace();
  carries_->push_back(static_cast<std::uint32_t>(bucket));
}

void LogLinearHistogram::Counters::merge(const Counters& other) {
  for (std::size_t block = 0; block < other.places_.size(); ++block) {
    if (other.places_[block] == 0) continue;
    if (block >= places_.size() || places_[block] == 0) add_block(block);
    auto* to = &counts_[(places_[block] - std::size_t{1}) * kBlock];
    const auto* from = &other.counts_[(other.places_[block] - std::size_t{1}) * kBlock];
    for (std::size_t i = 0; i < kBlock; ++i) {
      const auto sum = to[i] + from[i];
      if (sum < from[i]) carry(block * kBlock + i);
      to[i] = sum;
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

void LogLinearHistogram::add(std::span<const std::int64_t> values) {
  for (const auto value : values) {
    const auto bucket = bucket_of(magnitude(value));
    if (value >= 0) [[likely]] {
      positive_.add(bucket);
    } else {
      if (!negative_) negative_.emplace();
      negative_->add(bucket);
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

std::int64_t LogLinearHistogram::quantile(std::uint64_t numerator,
                                          std::uint64_t denominator) const {
  assert(count_ > 0 && numerator <= denominator);
  const auto product = static_cast<Int128>(count_) * numerator;
  const auto rank = std::max<std::uint64_t>(
      1, static_cast<std::uint64_t>((product + denominator - 1) / denominator));
  std::uint64_t seen = 0;
  for (auto i = negative_ ? negative_->size() : 0; i-- > 0;) {  // largest magnitude first
    seen += (*negative_)[i];
    if (seen >= rank) return static_cast<std::int64_t>(0 - value_of(i));
  }
  for (auto i = positive_.next(0); i < positive_.size(); i = positive_.next(i + 1)) {
    seen += positive_[i];
    if (seen >= rank) return static_cast<std::int64_t>(value_of(i));
  }
  return 0;
}

std::vector<HistogramBucket> LogLinearHistogram::buckets() const {
  std::vector<HistogramBucket> all;
  const auto add = [&all](std::uint64_t value, std::uint64_t count) {
    if (count > 0) all.push_back({.value = static_cast<std::int64_t>(value), .count = count});
  };
  for (auto i = negative_ ? negative_->size() : 0; i-- > 0;)
    add(0 - value_of(i), (*negative_)[i]);
  for (auto i = positive_.next(0); i < positive_.size(); i = positive_.next(i + 1))
    add(value_of(i), positive_[i]);
  return all;
}

void Statistics::Values::settle() {
  if (waiting_count == 0) return;
  if (histogram.count() == 0) min = max = waiting.front();
  const std::span<const std::int64_t> values(waiting.data(), waiting_count);
  auto least = min;
  auto most = max;
  auto total = sum;
  for (const auto value : values) {
    least = std::min(least, value);
    most = std::max(most, value);
    total += value;
  }
  min = least;
  max = most;
  sum = total;
  histogram.add(values);
  waiting_count = 0;
}

std::int64_t Statistics::Values::quantile(std::uint64_t numerator,
                                          std::uint64_t denominator) const {
  return std::clamp(histogram.quantile(numerator, denominator), min, max);
}

void Statistics::merge(const Statistics& other) {
  if (!other.values_) return;
  other.values_->settle();
  if (!values_) {
    *this = other;
    return;
  }
  values_->settle();
  values_->min = std::min(values_->min, other.values_->min);
  values_->max = std::max(values_->max, other.values_->max);
  values_->sum += other.values_->sum;
  values_->histogram.merge(other.values_->histogram);
}

std::int64_t Statistics::at_rank(std::uint64_t rank) const {
  if (!values_) return 0;
  values_->settle();
  return values_->quantile(rank, count());
}

std::optional<Summary> Statistics::summary(bool with_buckets) const {
  if (!values_) return std::nullopt;
  auto& values = *values_;
  values.settle();
  return Summary{
      .count = count(),
      .min = values.min,
      .max = values.max,
      .sum = clamped(values.sum),
      .mean = static_cast<double>(values.sum) / static_cast<double>(count()),
      .p50 = values.quantile(50, 100),
      .p90 = values.quantile(90, 100),
      .p99 = values.quantile(99, 100),
      .p99_9 = values.quantile(999, 1000),
      .buckets = with_buckets ? values.histogram.buckets() : std::vector<HistogramBucket>{}};
}

}  // namespace cie::analysis
