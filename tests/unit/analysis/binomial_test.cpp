// What chance alone does in so many trials.
#include "studies/binomial.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// 0.5^4 times 1, 4, 6, 4, 1.
TEST(Binomial, IsExactForFewTrials) {
  EXPECT_NEAR(binomial_cdf(4, 0.5, 0), 1 / 16.0, 1e-12);
  EXPECT_NEAR(binomial_cdf(4, 0.5, 2), 11 / 16.0, 1e-12);
  EXPECT_EQ(binomial_cdf(4, 0.5, 4), 1);
  EXPECT_EQ(binomial_cdf(4, 0.5, -1), 0);
  EXPECT_EQ(binomial_quantile(4, 0.5, 0.5), 2);
  EXPECT_EQ(binomial_quantile(4, 0.5, 0.01), 0);
}

// 0.99^100 = 0.36603…: no underflow of the tail, and one at 10 000 that stays finite.
TEST(Binomial, HasTails) {
  EXPECT_NEAR(binomial_cdf(100, 0.01, 0), std::pow(0.99, 100), 1e-12);
  EXPECT_NEAR(binomial_cdf(20'000, 0.5, 10'000) + binomial_cdf(20'000, 0.5, 9'999), 1, 1e-9);
}

TEST(Binomial, IsContinuousWhereItBecomesNormal) {
  // Variances just below and above the bound, at the same deviation from the mean.
  const double exact = binomial_cdf(39'999, 0.5, 19'999 - 100);
  const double normal = binomial_cdf(40'001, 0.5, 20'000 - 100);
  EXPECT_NEAR(exact, normal, 0.005);
}

}  // namespace
}  // namespace cie::analysis
