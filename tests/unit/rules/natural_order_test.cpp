#include "model/natural_order.hpp"

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

TEST(NaturalOrder, ComparesNumbersByValue) {
  EXPECT_TRUE(natural_order("thread 9", "thread 10") < 0);
  EXPECT_TRUE(natural_order("thread 101", "thread 19") > 0);
  EXPECT_TRUE(natural_order("a2b10", "a2b9") > 0);
}

TEST(NaturalOrder, TakesLeadingZerosForNothing) {
  EXPECT_TRUE(natural_order("lane 07", "lane 8") < 0);
  EXPECT_TRUE(natural_order("lane 007", "lane 7") == 0);
}

TEST(NaturalOrder, ComparesOtherTextByCharacters) {
  EXPECT_TRUE(natural_order("fusion", "plan") < 0);
  EXPECT_TRUE(natural_order("plan", "planner") < 0);
  EXPECT_TRUE(natural_order("plan", "plan") == 0);
}

// Whether char is signed differs between machines (x86-64, AArch64); UTF-8 sorts by its bytes' values.
TEST(NaturalOrder, ComparesBytesAsUnsigned) {
  EXPECT_TRUE(natural_order("z", "\xc3\xa9") < 0);
  EXPECT_TRUE(natural_order("lane z 10", "lane \xc3\xa9 9") < 0);
}

}  // namespace
}  // namespace cie::analysis
