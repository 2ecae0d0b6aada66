// Headers of events as LTTng declares them: what the compiler knows of two of them is what their
// metadata says.
#include <array>
#include <cstdint>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>

#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/layout.hpp>
#include <ctf/program/trace_plan.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using HeaderBytes = std::array<std::uint8_t, 32>;

// A tag of so many bits that is the id, or says that id and time are whole.
std::string header(unsigned tag_bits, unsigned time_bits, unsigned align) {
  const auto last = (std::uint64_t{1} << tag_bits) - 1;
  const auto integer = [align](unsigned bits, const std::string& more = "") {
    return "integer { size = " + std::to_string(bits) +
           "; align = " + std::to_string(bits % 8 == 0 ? align : 1) + "; " + more + "}";
  };
  const std::string clock = "map = clock.c.value; ";
  return "/* CTF 1.8 */\ntrace { major = 1; minor = 8; byte_order = le; };\n"
         "clock { name = c; };\n"
         "stream { event.header := struct {\n"
         "  enum : " +
         integer(tag_bits) + " { compact = 0 ... " + std::to_string(last - 1) +
         ", extended = " + std::to_string(last) +
         " } id;\n"
         "  variant <id> {\n"
         "    struct { " +
         integer(time_bits, clock) +
         " timestamp; } compact;\n"
         "    struct { " +
         integer(32) + " id; " + integer(64, clock) +
         " timestamp; } extended;\n"
         "  } v;\n"
         "} align(" +
         std::to_string(align) + "); };\nevent { name = \"e\"; id = 0; };\n";
}

HeaderLayout layout_of_header(const std::string& metadata) {
  const TracePlan plan(parse_metadata(metadata));
  const auto* stream = plan.find(0);
  if (stream == nullptr || !stream->header_layout) throw std::invalid_argument("no fixed header");
  return *stream->header_layout;
}

TEST(EventHeader, OfFewClassesHasFiveBitsOfIdAnd27OfTime) {
  const HeaderBytes brief{0x23, 0x00, 0x00, 0x80};  // 3, and 0x80000023 / 32 of the time
  const auto read = CompactHeader::read(brief.data(), 0x9000'0000);
  EXPECT_EQ(read.id, 3U);
  EXPECT_EQ(read.clock, 0x9400'0001U);
  EXPECT_EQ(read.bytes, 4U);
  const HeaderBytes whole{0xff, 0x02, 0x01, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1};
  const auto extended = CompactHeader::read(whole.data(), 0x9000'0000);
  EXPECT_EQ(extended.id, 0x102U);
  EXPECT_EQ(extended.clock, 0x0102'0304'0506'0708U);
  EXPECT_EQ(extended.bytes, 13U);
}

TEST(EventHeader, OfManyClassesHas16BitsOfIdAnd32OfTime) {
  const HeaderBytes brief{0x02, 0x01, 4, 3, 2, 1};
  const auto read = LargeHeader::read(brief.data(), 0x5'0000'0000);
  EXPECT_EQ(read.id, 0x102U);
  EXPECT_EQ(read.clock, 0x5'0102'0304U);
  EXPECT_EQ(read.bytes, 6U);
  const HeaderBytes whole{0xff, 0xff, 2, 1, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1};
  const auto extended = LargeHeader::read(whole.data(), 0);
  EXPECT_EQ(extended.id, 0x102U);
  EXPECT_EQ(extended.clock, 0x0102'0304'0506'0708U);
  EXPECT_EQ(extended.bytes, 14U);
}

template <typename Header>
void expect_as_declared(Header /*header*/, const HeaderLayout& layout) {
  std::mt19937_64 random(1);  // NOLINT(cert-msc32-c,cert-msc51-cpp): the same every time
  for (int i = 0; i < 10'000; ++i) {
    HeaderBytes bytes{};
    for (auto& byte : bytes)
      byte = static_cast<std::uint8_t>(random());
    if (i % 2 == 0) bytes[0] = bytes[1] = 0xff;
    const auto last = random();
    const auto read = Header::read(bytes.data(), last);
    const auto declared = layout.read(bytes.data(), last);
    ASSERT_TRUE(declared);
    ASSERT_EQ(read.id, declared->id);
    ASSERT_EQ(read.clock, declared->clock);
    ASSERT_EQ(read.bytes, declared->bytes);
  }
}

TEST(EventHeader, IsReadAsItsMetadataSays) {
  const auto compact = layout_of_header(header(5, 27, 8));
  EXPECT_EQ(compact.shape, HeaderLayout::Shape::compact);
  expect_as_declared(CompactHeader{}, compact);
  const auto large = layout_of_header(header(16, 32, 8));
  EXPECT_EQ(large.shape, HeaderLayout::Shape::large);
  expect_as_declared(LargeHeader{}, large);
}

TEST(EventHeader, ThatIsLaidOutOtherwiseIsNotTakenForOne) {
  for (const auto& other : {header(6, 26, 8), header(5, 19, 8), header(8, 32, 8)}) {
    EXPECT_EQ(layout_of_header(other).shape, HeaderLayout::Shape::other) << other;
  }
}

}  // namespace
}  // namespace cie::analysis::ctf
