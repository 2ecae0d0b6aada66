// What LTTng's notifications carry.
#include "lttng/event_watch.hpp"

#include <cstdint>
#include <string>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

TEST(PidOf, IsTheOneThatWasCaptured) {
  EXPECT_EQ(pid_of(std::int64_t{1}), 1);
  EXPECT_EQ(pid_of(std::int64_t{32'630}), 32'630);
  EXPECT_EQ(pid_of(std::int64_t{4'194'304}), 4'194'304);
  EXPECT_EQ(pid_of({}), 0);
  EXPECT_EQ(pid_of(std::string("32630")), 0);
}

TEST(PidOf, HasItsBytesPutInOrderAgain) {
  EXPECT_EQ(pid_of(std::int64_t{0x767f'0000'0000'0000}), 0x7f76);  // as Ubuntu 22.04 recorded it
  EXPECT_EQ(pid_of(static_cast<std::int64_t>(0xff86'3d00'0000'0000U)), 0x3d'86ff);  // below 0
  EXPECT_EQ(pid_of(std::int64_t{5'000'000'000}), 5'000'000'000) << "neither way a pid";
}

}  // namespace
}  // namespace cie::record
