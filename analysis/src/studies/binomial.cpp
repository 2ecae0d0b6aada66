#include "binomial.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cie::analysis {
namespace {

constexpr double kExactVariance = 10'000;
constexpr double kDeviations = 40;  // of the mean; what lies beyond is below 1e-300

double log_pmf(double n, double p, double k) {
  return std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) + k * std::log(p) +
         (n - k) * std::log1p(-p);
}

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace

double binomial_cdf(std::uint64_t n, double p, std::int64_t k) {
  if (k < 0) return 0;
  if (static_cast<std::uint64_t>(k) >= n) return 1;
  const auto size = static_cast<double>(n);
  const double mean = size * p;
  const double variance = mean * (1 - p);
  const auto last = static_cast<double>(k);
  if (variance > kExactVariance) return normal_cdf((last + 0.5 - mean) / std::sqrt(variance));
  const double reach = kDeviations * std::sqrt(variance + 1);
  const double first = std::max(0.0, std::floor(mean - reach));
  double sum = 0;
  const auto end = static_cast<std::uint64_t>(std::min(last, mean + reach));
  for (auto i = static_cast<std::uint64_t>(first); i <= end; ++i)
    sum += std::exp(log_pmf(size, p, static_cast<double>(i)));
  return std::min(sum, 1.0);
}

std::int64_t binomial_quantile(std::uint64_t n, double p, double q) {
  std::int64_t below = -1;  // cdf < q
  auto enough = static_cast<std::int64_t>(n);
  while (enough - below > 1) {
    const std::int64_t middle = below + (enough - below) / 2;
    (binomial_cdf(n, p, middle) >= q ? enough : below) = middle;
  }
  return enough;
}

}  // namespace cie::analysis
