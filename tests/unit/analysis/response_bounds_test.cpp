// Response times of callbacks of which some releases are known and others are not.
#include "support/trace_text.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

// That many instances that take 100 from their release, and others that take 5 from their start.
analysis::CallbackReport with_releases(int known, int unknown) {
  std::string text = "callback fusion timer period=1000\n";
  for (int i = 0; i < known + unknown; ++i) {
    const auto release = 1000 * (i + 1);
    const bool is_known = i < known;
    text += std::to_string(release + 10) +
            " start fusion release=" + (is_known ? std::to_string(release) : "none") + '\n' +
            std::to_string(release + (is_known ? 100 : 15)) + " end fusion\n";
  }
  return analyze(trace_of(text)).report.callbacks.at(0);
}

TEST(ResponseBounds, CountEachInstanceByWhatIsKnownOfIt) {
  const auto some = with_releases(3, 4);
  ASSERT_TRUE(some.response_time_at_least);
  EXPECT_EQ(some.response_time_at_least->count, 7U);
  EXPECT_EQ(some.response_time_at_least->sum, 3 * 100 + 4 * 5);
  EXPECT_EQ(some.response_time_at_least->p50, 5) << "the fourth of seven";
  EXPECT_EQ(some.response_time_at_least->max, 100);
  EXPECT_FALSE(with_releases(7, 0).response_time_at_least);
  EXPECT_FALSE(with_releases(0, 7).response_time_at_least);
}

// Had the others taken longer than all: of 9 the median would be the fifth of those known.
TEST(ResponseBounds, AMedianIsKnownIfTheOthersCannotMoveIt) {
  EXPECT_EQ(with_releases(7, 2).is_median_known, true);
  EXPECT_EQ(with_releases(5, 4).is_median_known, true) << "the fifth, either way";
  EXPECT_EQ(with_releases(4, 5).is_median_known, false) << "5 or any time";
  EXPECT_EQ(with_releases(7, 0).is_median_known, std::nullopt);
}

}  // namespace
}  // namespace cie::test
