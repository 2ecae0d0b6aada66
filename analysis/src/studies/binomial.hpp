// The binomial distribution, as far as comparisons need it.
#pragma once

#include <cstdint>

namespace cie::analysis {

// P(X <= k) of X ~ Bin(n, p), 0 < p < 1. Exact to about 1e-9 while the variance n p (1-p) is at
// most 10 000; beyond that the normal approximation with continuity correction, whose error is then
// below 0.003 (Berry-Esseen: 0.4748 / sqrt(n p (1-p)) bounds it by 0.005).
double binomial_cdf(std::uint64_t n, double p, std::int64_t k);

// The smallest k with P(X <= k) >= q, 0 < q < 1.
std::int64_t binomial_quantile(std::uint64_t n, double p, double q);

}  // namespace cie::analysis
