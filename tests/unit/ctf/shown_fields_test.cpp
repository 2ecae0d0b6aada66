// What programs show of events, from bytes laid out by hand.
#include <bit>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/event_choice.hpp>
#include <ctf/program/scope.hpp>
#include <gtest/gtest.h>
#include <vocabulary/field.hpp>

namespace cie::analysis::ctf {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ValueKind = FieldValue::Kind;

// The first event of that metadata; bytes of one.
class Shown {
 public:
  explicit Shown(const std::string& declarations)
      : metadata_(parse_metadata("trace { major = 1; minor = 8; byte_order = le; };\n"
                                 "typealias integer { size = 8; } := u8;\n"
                                 "event { fields := struct { " +
                                 declarations + " }; };")),
        choice_([](std::string_view) { return true; }, true),
        scope_("event.fields", context_, registers_, {}) {
    scope_.build_shown(metadata_.events.at(0).fields, {}, choice_);
  }

  Outcome decode(const Bytes& bytes) {
    fields_.clear();
    frame_.shown = &fields_;
    frame_.steps = 1'000'000;
    Bits bits{.data = bytes.data(), .at = 0, .end = bytes.size() * 8};
    return run(scope_.program(), bits, frame_);
  }
  std::span<const FieldValue> values() const { return fields_.values(); }

  // "a=1 s{b="x" } l[2 3 ]"
  std::string text(const Bytes& bytes) {
    EXPECT_EQ(decode(bytes), Outcome::ok);
    std::string text;
    for (const auto& value : values()) {
      text += value.name;
      switch (value.kind) {
        case ValueKind::structure:
          text += '{';
          continue;
        case ValueKind::list:
          text += '[';
          continue;
        case ValueKind::end:
          text += "end ";
          continue;
        case ValueKind::text:
          text += "=\"" + std::string(value.text) + "\" ";
          continue;
        case ValueKind::real:
          text += '=' + std::to_string(std::bit_cast<double>(value.number)) + ' ';
          continue;
        case ValueKind::opaque:
          text += "=? ";
          continue;
        case ValueKind::label:
          text += '=' + std::string(value.text) + ':';
          break;
        default:
          text += '=';
      }
      text += std::to_string(value.number) + (value.is_hexadecimal ? "x " : " ");
    }
    return text;
  }

 private:
  Metadata metadata_;
  EventChoice choice_;
  BuildContext context_;
  RegisterRange registers_{.next = 0, .end = kRegisters};
  Scope scope_;
  Frame frame_;
  ShownFields fields_;
};

TEST(ShownFields, NumbersByTheirSignsAndBases) {
  Shown shown(
      "u8 a; integer { size = 8; signed = 1; } _b; integer { size = 16; base = 16; } c; "
      "integer { size = 3; } d; integer { size = 5; signed = 1; base = hex; } e;");
  // d = 5, e = -1: 0b11111'101
  EXPECT_EQ(shown.text({200, 0xfe, 0x34, 0x12, 0xfd}), "a=200 b=-2 c=4660x d=5 e=-1x ");
  EXPECT_EQ(shown.values()[0].kind, ValueKind::natural);
  EXPECT_EQ(shown.values()[1].kind, ValueKind::integer);
}

TEST(ShownFields, Reals) {
  Shown shown(
      "floating_point { exp_dig = 8; mant_dig = 24; } a; floating_point { exp_dig = 11; mant_dig = "
      "53; } b; floating_point { exp_dig = 5; mant_dig = 11; } c; u8 d;");
  // 1.5f = 0x3fc00000; -2.0 = 0xc000000000000000; nobody reads 16 bits.
  EXPECT_EQ(shown.text({0, 0, 0xc0, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0xc0, 1, 2, 7}),
            "a=1.500000 b=-2.000000 c=? d=7 ");
}

TEST(ShownFields, LabelsAndWhatHasNone) {
  Shown shown(
      "enum : integer { size = 8; signed = 1; } { low = -2 ... -1, \"zero x\" = 0 } a; "
      "enum : u8 { one = 1, uno = 1 } b; enum : u8 { one = 1 } c;");
  EXPECT_EQ(shown.text({0xff, 1, 9}), "a=low:-1 b=one:1 c=:9 ");
}

TEST(ShownFields, TextsStructuresAndLists) {
  Shown shown(
      "string s; integer { size = 8; encoding = UTF8; } name[4]; struct { u8 x; struct { u8 y; } "
      "in; } p; u8 n; u8 list[n]; struct { string t; } two[2]; u8 none[0];");
  EXPECT_EQ(shown.text({'h', 'i', 0, 'a', 'b', 0, 'c', 1, 2, 3, 7, 8, 9, 'u', 0, 0}),
            "s=\"hi\" name=\"ab\" p{x=1 in{y=2 end end n=3 list[=7 =8 =9 end "
            "two[{t=\"u\" end {t=\"\" end end none[end ");
}

TEST(ShownFields, AnOptionStandsUnderTheVariantsName) {
  Shown shown(
      "enum : u8 { num = 0, rec = 1 } tag; variant <tag> { u8 num; struct { u8 m; } rec; } v; "
      "u8 after;");
  EXPECT_EQ(shown.text({0, 5, 6}), "tag=num:0 v=5 after=6 ");
  EXPECT_EQ(shown.text({1, 5, 6}), "tag=rec:1 v{m=5 end after=6 ");
}

TEST(ShownFields, MoreValuesThanAnybodyLooksAtAreOne) {
  Shown shown("integer { size = 32; } n; struct { u8 x; } list[n]; u8 after;");
  Bytes bytes(4 + 100'000 + 1, 1);
  const std::uint32_t count = 100'000;
  for (unsigned i = 0; i < 4; ++i)
    bytes[i] = static_cast<std::uint8_t>(count >> (8 * i));
  EXPECT_EQ(shown.decode(bytes), Outcome::ok);
  EXPECT_LE(shown.values().size(), kMaxElements + 8);
  EXPECT_GE(shown.values().size(), kMaxElements);
  int depth = 0;
  for (const auto& value : shown.values()) {
    depth += value.kind == ValueKind::structure || value.kind == ValueKind::list ? 1 : 0;
    depth -= value.kind == ValueKind::end ? 1 : 0;
    EXPECT_GE(depth, 0);
  }
  EXPECT_EQ(depth, 0);
}

TEST(ShownFields, AScopeReadAgainTakesBackWhatItShowed) {
  Shown shown("u8 a; u8 b;");
  EXPECT_EQ(shown.decode({1}), Outcome::cut);
  ShownFields fields;
  const ShownField field{.kind = ValueKind::natural, .name = "a"};
  fields.number(field, 1);
  const auto before = fields.size();
  fields.number(field, 2);
  fields.take_back(before);
  EXPECT_EQ(fields.values().size(), 1U);
}

TEST(ShownFields, AScopeThatIsReadAgainIsShownWhole) {
  const ShownField number{.kind = ValueKind::natural, .name = "n"};
  const ShownField scope{.kind = ValueKind::structure, .name = "s"};
  ShownFields fields;
  for (std::size_t i = 0; i < kMaxElements; ++i)
    fields.number(number, i);
  fields.open(scope);  // for which there is no room; then the bytes are at their end
  fields.take_back(0);
  fields.open(scope);
  fields.number(number, 1);
  fields.close();
  ASSERT_EQ(fields.values().size(), 3U);
  EXPECT_EQ(fields.values()[0].kind, ValueKind::structure);
  EXPECT_EQ(fields.values()[2].kind, ValueKind::end);
}

TEST(ShownFields, ALabelAboveAllNumbersWithASignIsANaturalNumberWithAText) {
  Type type{.kind = Type::Kind::enumeration};
  type.ranges = {{.label = "all", .low = ~std::uint64_t{0}, .high = ~std::uint64_t{0}}};
  ShownFields fields;
  fields.number({.kind = ValueKind::label, .name = "a", .type = &type}, ~std::uint64_t{0});
  fields.number({.kind = ValueKind::label, .name = "b", .type = &type}, ~std::uint64_t{0} - 1);
  type.is_signed = true;
  fields.number({.kind = ValueKind::label, .name = "c", .type = &type}, ~std::uint64_t{0});
  ASSERT_EQ(fields.values().size(), 3U);
  EXPECT_EQ(fields.values()[0].kind, ValueKind::natural);
  EXPECT_EQ(fields.values()[0].text, "all");
  EXPECT_EQ(fields.values()[1].kind, ValueKind::natural);
  EXPECT_EQ(fields.values()[1].text, "");
  EXPECT_EQ(fields.values()[2].kind, ValueKind::label);
}

TEST(ShownFields, OfManyLabelsTheFirstAreLookedAt) {
  Type type{.kind = Type::Kind::enumeration};
  for (std::uint64_t i = 0; i < 5000; ++i)
    type.ranges.push_back({.label = "x", .low = i, .high = i});
  ShownFields fields;
  fields.number({.kind = ValueKind::label, .name = "a", .type = &type}, 4095);
  fields.number({.kind = ValueKind::label, .name = "b", .type = &type}, 4096);
  EXPECT_EQ(fields.values()[0].text, "x");
  EXPECT_EQ(fields.values()[1].text, "");
}

TEST(ShownFields, MoreIsToldBehindAValueThatCannotBeRead) {
  const ShownField number{.kind = ValueKind::natural, .name = "n"};
  const ShownField opaque{.kind = ValueKind::opaque, .name = "wide"};
  ShownFields fields;
  for (std::size_t i = 1; i < kMaxElements; ++i)
    fields.number(number, i);
  fields.text(opaque, nullptr, 0);
  fields.number(number, 0);
  fields.number(number, 0);
  ASSERT_EQ(fields.values().size(), kMaxElements + 1);
  EXPECT_EQ(fields.values().back().name, "more");
}

}  // namespace
}  // namespace cie::analysis::ctf
