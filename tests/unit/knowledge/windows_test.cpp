#include "knowledge/windows.hpp"

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

Timestamp at_ns(std::int64_t ns) { return Timestamp{ns}; }

TEST(Windows, ThatMeetLeaveNoHole) {
  Windows windows;
  windows.add({at_ns(10), at_ns(20)});
  windows.add({at_ns(21), at_ns(30)});
  windows.add({at_ns(5), at_ns(10)});
  EXPECT_EQ(windows.end_of_window_at(at_ns(5)), at_ns(30));
  EXPECT_EQ(windows.end_of_window_at(at_ns(4)), std::nullopt);
  EXPECT_EQ(windows.end_of_window_at(at_ns(31)), std::nullopt);
}

TEST(Windows, ThatLeaveANanosecondBetweenThemAreTwo) {
  Windows windows;
  windows.add({at_ns(10), at_ns(20)});
  windows.add({at_ns(22), at_ns(30)});
  EXPECT_EQ(windows.end_of_window_at(at_ns(10)), at_ns(20));
  EXPECT_EQ(windows.end_of_window_at(at_ns(21)), std::nullopt);
  windows.add({at_ns(0), at_ns(40)});
  EXPECT_EQ(windows.end_of_window_at(at_ns(22)), at_ns(40));
}

TEST(Windows, EndWithTime) {
  Windows windows;
  windows.add({at_ns(5), at_ns(4)});
  EXPECT_TRUE(windows.empty());
  windows.add({at_ns(7), kLatest});
  windows.add({kEarliest, at_ns(6)});
  EXPECT_EQ(windows.end_of_window_at(kEarliest), kLatest);
}

}  // namespace
}  // namespace cie::analysis
