#include "dds/shared_memory.hpp"

#include <array>
#include <cstring>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

TEST(ChunkGaps, AreCountedForEachPublisher) {
  ChunkGaps gaps;
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 7}), 0U) << "the subscriber came later";
  EXPECT_EQ(gaps.before({.publisher = 2, .number = 0}), 0U);
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 8}), 0U);
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 11}), 2U) << "9 and 10";
  EXPECT_EQ(gaps.before({.publisher = 2, .number = 4}), 3U) << "1 to 3";
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 12}), 0U);
}

TEST(ChunkGaps, AreNotMadeByAHistoryThatComesAgain) {
  ChunkGaps gaps;
  gaps.before({.publisher = 1, .number = 5});
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 3}), 0U);
  EXPECT_EQ(gaps.before({.publisher = 1, .number = 6}), 0U);
}

// A header at 8, a sample at 48 and in front of it how far that is from the header.
struct Chunk {
  std::array<unsigned char, 64> bytes{};
  Chunk(std::uint8_t version, std::uint64_t publisher, std::uint64_t number) {
    put(8 + 4, version);
    put(8 + 8, publisher);
    put(8 + 16, number);
    put(48 - 4, std::uint32_t{48 - 8});
  }
  template <typename Value>
  void put(std::size_t at, const Value& value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }
  const void* sample() const { return bytes.data() + 48; }
};

TEST(ChunkNumber, StandsInItsHeader) {
  const Chunk chunk(1, 0xabcdef0123456789, 42);
  const auto number = number_of_chunk(chunk.sample());
  ASSERT_TRUE(number);
  EXPECT_EQ(number->publisher, 0xabcdef0123456789U);
  EXPECT_EQ(number->number, 42U);
}

TEST(ChunkNumber, IsUnknownInHeadersOfAnotherVersion) {
  EXPECT_FALSE(number_of_chunk(Chunk(2, 1, 42).sample()));
}

}  // namespace
}  // namespace cie::executor
