// Fields written by hand, read by protozero.
#include "output/field_writer.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <protozero/pbf_reader.hpp>

namespace cie::viewer_export {
namespace {

enum class Field : std::uint32_t { low = 1, high = 16, highest = 2047, inner = 3 };

TEST(FieldWriter, WritesWhatProtozeroReads) {
  constexpr auto kMax = std::numeric_limits<std::uint64_t>::max();
  for (const std::uint64_t value :
       {std::uint64_t{0}, std::uint64_t{127}, std::uint64_t{128}, std::uint64_t{1} << 32U, kMax}) {
    EncodedBytes bytes;
    FieldWriter out(bytes.room(100));
    out.number<Field::low>(value);
    out.fixed64<Field::high>(value);
    out.text<Field::highest>("text");
    bytes.end_at(out.at());
    protozero::pbf_reader reader(bytes.view().data(), bytes.view().size());
    ASSERT_TRUE(reader.next(1));
    EXPECT_EQ(reader.get_uint64(), value);
    ASSERT_TRUE(reader.next(16));
    EXPECT_EQ(reader.get_fixed64(), value);
    ASSERT_TRUE(reader.next(2047));
    EXPECT_EQ(reader.get_string(), "text");
    EXPECT_FALSE(reader.next());
  }
}

TEST(FieldWriter, WritesMessagesOfAnyLength) {
  // Around the lengths at which the length itself takes a byte more.
  for (const std::size_t size :
       {0U, 120U, 124U, 125U, 126U, 127U, 128U, 16'379U, 16'380U, 16'381U, 16'384U, 100'000U}) {
    const std::string text(size, 'x');
    EncodedBytes bytes;
    bytes.append("before");
    FieldWriter out(bytes.room(size + 100));
    out.message<Field::inner>([&] {
      out.message<Field::inner>([&] { out.text<Field::low>(text); });
      out.number<Field::low>(size);
    });
    bytes.end_at(out.at());
    ASSERT_EQ(bytes.view().substr(0, 6), "before");
    const auto written = bytes.view().substr(6);
    protozero::pbf_reader reader(written.data(), written.size());
    ASSERT_TRUE(reader.next(3));
    auto outer = reader.get_message();
    EXPECT_FALSE(reader.next());
    ASSERT_TRUE(outer.next(3));
    auto inner = outer.get_message();
    ASSERT_TRUE(outer.next(1));
    EXPECT_EQ(outer.get_uint64(), size);
    EXPECT_FALSE(outer.next());
    ASSERT_TRUE(inner.next(1));
    EXPECT_EQ(inner.get_string(), text);
    EXPECT_FALSE(inner.next());
  }
}

}  // namespace
}  // namespace cie::viewer_export
