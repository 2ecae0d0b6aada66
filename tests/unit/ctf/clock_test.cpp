#include <ctf/stream/event_cursor.hpp>
#include <ctf/stream/packet.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

TEST(Clock, LowBitsExtendTheLastValueAndWrapOnce) {
  EXPECT_EQ(extend_clock(0x1'0000'0010, 0x20, 32), 0x1'0000'0020U);
  EXPECT_EQ(extend_clock(0x1'0000'0010, 0x10, 32), 0x1'0000'0010U);
  EXPECT_EQ(extend_clock(0x1'0000'0010, 0x0f, 32), 0x2'0000'000fU);
  EXPECT_EQ(extend_clock(0x7ff'ffff, 0, 27), 0x800'0000U);
  EXPECT_EQ(extend_clock(7, 3, 64), 3U);
}

TEST(Clock, CyclesBecomeNanoseconds) {
  ClockPlan clock;
  clock.frequency = 1'000;
  EXPECT_EQ(clock.time_of(5).ns, 5'000'000);
  clock.frequency = 2'000'000'000;
  EXPECT_EQ(clock.time_of(0xffff'ffff'ffff'ffffU).ns, 0x7fff'ffff'ffff'ffff);
}

TEST(Counters, WrapAtTheirWidth) {
  EXPECT_EQ((Counter{.value = 2, .bits = 32}.since(0xffff'ffffU)), 3U);
  EXPECT_EQ((Counter{.value = 2, .bits = 64}.since(~std::uint64_t{0})), 3U);
}

}  // namespace
}  // namespace cie::analysis::ctf
