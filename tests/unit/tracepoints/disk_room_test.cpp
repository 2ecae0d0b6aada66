#include "system/disk_room.hpp"

#include <cstdint>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

TEST(DiskRoom, IsFullWithoutABlockLeft) {
  EXPECT_TRUE(is_full({.capacity = 1 << 20, .free = 0, .available = 0}, false));
  EXPECT_TRUE(is_full({.capacity = 1 << 20, .free = 0, .available = 0}, true));
  EXPECT_FALSE(is_full({.capacity = 1 << 20, .free = 4096, .available = 4096}, false));
}

TEST(DiskRoom, OfRootIsMoreThanOthersHave) {
  constexpr std::filesystem::space_info kRest{.capacity = 1 << 20, .free = 4096, .available = 0};
  EXPECT_TRUE(is_full(kRest, false));
  EXPECT_FALSE(is_full(kRest, true));
}

TEST(DiskRoom, IsThereWhereNothingIsCounted) {
  EXPECT_FALSE(is_full({.capacity = 0, .free = 0, .available = 0}, true));
  constexpr auto kUnknown = static_cast<std::uintmax_t>(-1);
  EXPECT_FALSE(is_full({.capacity = kUnknown, .free = 0, .available = 0}, false));
}

}  // namespace
}  // namespace cie::record
