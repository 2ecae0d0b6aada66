#include "rolling.hpp"

#include <gtest/gtest.h>

namespace cie::live {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

TEST(Rolling, KeepsTheLastTenSlicesOfASecond) {
  Rolling rolling;
  for (std::int64_t second = 0; second < 20; ++second)
    rolling.add({second * kSecond + 5}, {100 + second}, second == 19, second == 18 ? 3 : 0);
  const auto sum = rolling.sum({19 * kSecond + 500});
  EXPECT_EQ(sum.instances, 10U);  // of seconds 10 to 19
  EXPECT_EQ(sum.late, 1U);
  EXPECT_EQ(sum.missed, 3U);
  ASSERT_TRUE(sum.response);
  EXPECT_EQ(sum.response->min, 110);
  EXPECT_EQ(sum.response->max, 119);
  EXPECT_EQ(sum.response->sum, 10 * (110 + 119) / 2);
}

TEST(Rolling, ForgetsWhileNothingComes) {
  Rolling rolling;
  rolling.add({kSecond}, {7}, true, 0);
  EXPECT_EQ(rolling.sum({10 * kSecond + kSecond - 1}).instances, 1U);
  EXPECT_EQ(rolling.sum({11 * kSecond}).instances, 0U);
  EXPECT_FALSE(rolling.sum({11 * kSecond}).response);
}

TEST(Rolling, AnInstanceFromBeforeTheWindowIsNotCounted) {
  Rolling rolling;
  rolling.add({25 * kSecond}, {1}, false, 0);
  rolling.add({15 * kSecond}, {2}, false, 0);  // the slice is taken by second 25
  EXPECT_EQ(rolling.sum({25 * kSecond}).instances, 1U);
}

TEST(Rolling, CoversNineToTenSeconds) {
  EXPECT_EQ(Rolling::covered({20 * kSecond}).ns, 9 * kSecond);
  EXPECT_EQ(Rolling::covered({21 * kSecond - 1}).ns, 10 * kSecond - 1);
}

}  // namespace
}  // namespace cie::live
