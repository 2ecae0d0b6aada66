// What announcements say was overwritten, and what of it was.
#include "overwritten_count.hpp"

#include <gtest/gtest.h>

namespace cie_rclcpp {
namespace {

constexpr std::uint64_t kOne = 1;  // a writer
constexpr std::uint64_t kOther = 2;

// A message waits in a queue of depth 1, and its writer goes: nothing is overwritten, however often.
TEST(OverwrittenCount, TheEndOfAWriterIsNone) {
  OverwrittenCount count{1, false};
  for (std::uint64_t writer = 1; writer <= 10; ++writer) {
    EXPECT_EQ(count.count(writer), 0U);
    count.on_taken(writer, writer);
    count.on_empty();
  }
  EXPECT_EQ(count.count(10), 0U);
}

TEST(OverwrittenCount, AllIsCertainOnceTheWriterIsHeardAgain) {
  OverwrittenCount count{2, false};
  count.on_taken(kOne, 0);
  EXPECT_EQ(count.count(5), 4U);
  count.on_taken(kOne, 5);
  count.on_taken(kOne, 5);
  EXPECT_EQ(count.count(5), 4U) << "it may have waited before";
  count.on_taken(kOne, 5);
  EXPECT_EQ(count.count(5), 5U);
}

// What is taken after an empty queue came after all that was overwritten.
TEST(OverwrittenCount, OrTheFirstAfterAnEmptyQueueIs) {
  OverwrittenCount count{10, false};
  count.on_taken(kOne, 0);
  count.on_taken(kOne, 1);
  count.on_empty();
  EXPECT_EQ(count.count(1), 0U);
  count.on_taken(kOne, 1);
  EXPECT_EQ(count.count(1), 1U);
}

TEST(OverwrittenCount, OneIsLeftOutWhereAnotherWriterFollows) {
  OverwrittenCount count{1, false};
  count.on_taken(kOne, 4);
  count.on_taken(kOther, 4);
  EXPECT_EQ(count.count(4), 3U);
  EXPECT_EQ(count.count(6), 4U);
}

// Who is heard first when something was overwritten may have followed one that ended.
TEST(OverwrittenCount, AWriterThatIsNewThenIsNoProof) {
  OverwrittenCount count{1, false};
  count.on_taken(kOne, 0);
  count.on_taken(kOther, 2);
  EXPECT_EQ(count.count(2), 1U);
  count.on_taken(kOther, 5);
  EXPECT_EQ(count.count(5), 3U);
  count.on_taken(kOther, 5);
  EXPECT_EQ(count.count(5), 4U) << "it was heard before these";
}

TEST(OverwrittenCount, NothingThatMayBeOthersCounts) {
  OverwrittenCount count{1, true};
  count.on_taken(kOne, 7);
  EXPECT_EQ(count.count(7), 0U);
  count.on_other();
  count.on_taken(kOne, 7);
  EXPECT_EQ(count.count(7), 0U);
}

TEST(OverwrittenCount, ButWhereNoneIsMetWhatIsCertain) {
  OverwrittenCount count{1, true};
  count.on_taken(kOne, 0);
  count.on_taken(kOne, 7);
  count.on_taken(kOne, 7);
  EXPECT_EQ(count.count(9), 7U);
}

}  // namespace
}  // namespace cie_rclcpp
