// Memory for packets: parts of one piece, small (of the heap) or large (mapped).
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <ctf/stream/packet_memory.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

class PacketMemoryOf : public testing::TestWithParam<std::size_t> {};

TEST_P(PacketMemoryOf, GivesEachPartOnce) {
  const auto bytes = GetParam();
  PacketMemory memory(PacketMemory::size_of_part(bytes) + PacketMemory::size_of_part(1));
  const auto first = memory.take(bytes);
  const auto second = memory.take(1);
  ASSERT_EQ(first.size(), bytes);
  ASSERT_EQ(second.size(), 1U);
  EXPECT_TRUE(memory.take(1).empty());
  for (const auto part : {first, second})
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(part.data()) % 16, 0U);
  second[0] = 7;
  std::ranges::fill(first, std::uint8_t{1});
  EXPECT_EQ(second[0], 7);
  EXPECT_EQ(std::ranges::count(first, 1), static_cast<std::ptrdiff_t>(bytes));
  memory = {};
  EXPECT_TRUE(memory.take(1).empty());
}

INSTANTIATE_TEST_SUITE_P(Sizes, PacketMemoryOf,
                         testing::Values(1, 64, 1000, std::size_t{5} << 20U));

TEST(PacketMemory, HasNoneThatTheMachineDoesNotGive) {
  EXPECT_TRUE(PacketMemory().take(1).empty());
  EXPECT_TRUE(PacketMemory(0).take(1).empty());
  EXPECT_TRUE(PacketMemory(std::numeric_limits<std::size_t>::max() / 2).take(1).empty());
}

}  // namespace
}  // namespace cie::analysis::ctf
