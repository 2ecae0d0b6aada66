#include "window_option.hpp"

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

using Origin = WindowBound::Origin;

WindowBound bound(Origin origin, std::int64_t ns) { return {.origin = origin, .offset = {ns}}; }

TEST(WindowBound, HasThreeOriginsOrNone) {
  EXPECT_EQ(parse_window_bound(""), WindowBound{});
  EXPECT_EQ(parse_window_bound("983005016596"), bound(Origin::clock, 983'005'016'596));
  EXPECT_EQ(parse_window_bound("0"), bound(Origin::clock, 0));
  EXPECT_EQ(parse_window_bound("+1s"), bound(Origin::begin, 1'000'000'000));
  EXPECT_EQ(parse_window_bound("-2s"), bound(Origin::end, -2'000'000'000));
}

TEST(WindowBound, HasUnitsAndExactFractions) {
  EXPECT_EQ(parse_window_bound("+7ns"), bound(Origin::begin, 7));
  EXPECT_EQ(parse_window_bound("+7us"), bound(Origin::begin, 7'000));
  EXPECT_EQ(parse_window_bound("+7ms"), bound(Origin::begin, 7'000'000));
  EXPECT_EQ(parse_window_bound("+2min"), bound(Origin::begin, 120'000'000'000));
  EXPECT_EQ(parse_window_bound("+1.5s"), bound(Origin::begin, 1'500'000'000));
  EXPECT_EQ(parse_window_bound("-0.000000001s"), bound(Origin::end, -1));
  EXPECT_EQ(parse_window_bound("+0.25min"), bound(Origin::begin, 15'000'000'000));
  EXPECT_EQ(parse_window_bound("+1.50us"), bound(Origin::begin, 1'500));
}

TEST(WindowBound, RefusesWhatCouldMeanTwoThings) {
  for (const auto* text :
       {"1s", "+1", "-1", "+", "-", "+s", "+.5s", "+1.s", "+1.5ns", "+0.0000000001s", "+1h", "+-1s",
        "1.5", "x", "+1e3s", "+99999999999999s", "99999999999999999999", " 1", "--1s"}) {
    EXPECT_THROW(parse_window_bound(text), UsageError) << text;
  }
}

}  // namespace
}  // namespace cie::cli
