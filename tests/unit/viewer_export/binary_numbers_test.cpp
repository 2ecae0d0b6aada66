#include "output/binary_numbers.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using namespace std::string_literals;

constexpr auto kLeastInteger = std::numeric_limits<std::int64_t>::min();
constexpr auto kMostInteger = std::numeric_limits<std::int64_t>::max();

std::string varint_of(std::uint64_t number) {
  std::string bytes;
  append_varint(bytes, number);
  return bytes;
}

TEST(Varint, HasSevenBitsToAByteTheLowestFirst) {
  EXPECT_EQ(varint_of(0), "\x00"s);
  EXPECT_EQ(varint_of(127), "\x7f");
  EXPECT_EQ(varint_of(128), "\x80\x01");
  EXPECT_EQ(varint_of(300), "\xac\x02") << "2 * 128 + 44";
  EXPECT_EQ(varint_of(~std::uint64_t{0}), std::string(9, '\xff') + '\x01');
}

TEST(Varint, IsTheSameInMemoryAndIsReadAgain) {
  for (unsigned bits = 0; bits < 64; ++bits) {
    for (const auto number : {(std::uint64_t{1} << bits) - 1, std::uint64_t{1} << bits}) {
      std::array<char, kLongestVarint> bytes{};
      const char* const begin = bytes.data();
      const char* const end = put_varint(number, bytes.data());
      EXPECT_EQ(std::string(begin, end), varint_of(number));
      std::uint64_t read = 1;
      EXPECT_EQ(get_varint(begin, read), end);
      EXPECT_EQ(read, number);
    }
  }
}

TEST(Zigzag, IsSmallNearZero) {
  EXPECT_EQ(zigzag(0), 0U);
  EXPECT_EQ(zigzag(-1), 1U);
  EXPECT_EQ(zigzag(1), 2U);
  EXPECT_EQ(zigzag(-2), 3U);
  EXPECT_EQ(zigzag(kMostInteger), ~std::uint64_t{0} - 1);
  EXPECT_EQ(zigzag(kLeastInteger), ~std::uint64_t{0});
  for (const auto value :
       {kLeastInteger, kLeastInteger + 1, std::int64_t{-1}, std::int64_t{0}, kMostInteger})
    EXPECT_EQ(unzigzag(zigzag(value)), value);
}

TEST(LittleEndian, HasItsLowestByteFirst) {
  std::string bytes;
  append_little_endian(bytes, std::uint32_t{0x04030201});
  EXPECT_EQ(bytes, "\x01\x02\x03\x04");
}

}  // namespace
}  // namespace cie::viewer_export
