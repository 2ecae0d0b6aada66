// Every kind of field against bytes laid out by hand.
#include "fields_of.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ctf/metadata/metadata_parser.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using test::Bytes;

// The fields of an event declared by `declarations`.
class Layout : public test::FieldsOf {
 public:
  Layout(const std::string& declarations, std::vector<FieldRequest> requests,
         const std::string& byte_order = "le")
      : FieldsOf(parse_metadata("trace { major = 1; minor = 8; byte_order = " + byte_order +
                                "; };\ntypealias integer { size = 8; } := u8;\n"
                                "typealias integer { size = 16; } := u16;\n"
                                "event { fields := struct { " +
                                declarations + " }; };"),
                 std::move(requests)) {}
};

TEST(Fields, IntegersOfEachWidthAndSign) {
  Layout layout(
      "integer { size = 8; signed = 1; } a; integer { size = 16; } b; "
      "integer { size = 32; signed = 1; } c; integer { size = 64; } d;",
      {"a", "b", "c", "d"});
  const Bytes bytes{0xfe, 0x34, 0x12, 0xff, 0xff, 0xff, 0xff, 1, 2, 3, 4, 5, 6, 7, 8};
  const auto got = layout.decode(bytes);
  EXPECT_EQ(got.outcome, Outcome::ok);
  EXPECT_EQ(got.number(0), -2);
  EXPECT_EQ(got.number(1), 0x1234);
  EXPECT_EQ(got.number(2), -1);
  EXPECT_EQ(got.number(3), 0x0807060504030201);
  EXPECT_EQ(got.end, 15U * 8);
}

TEST(Fields, BigEndianByTraceAndByType) {
  Layout layout(
      "u16 a; integer { size = 16; byte_order = le; } b; integer { size = 32; signed = 1; } c; "
      "integer { size = 64; signed = 1; } d; integer { size = 16; signed = 1; } e;",
      {"a", "b", "c", "d", "e"}, "be");
  const auto got = layout.decode({0x12, 0x34, 0x12, 0x34, 0xff, 0xff, 0xff, 0xfe, 0xff, 0xff, 0xff,
                                  0xff, 0xff, 0xff, 0xff, 0xfd, 0xff, 0xfc});
  EXPECT_EQ(got.number(0), 0x1234);
  EXPECT_EQ(got.number(1), 0x3412);
  EXPECT_EQ(got.number(2), -2);
  EXPECT_EQ(got.number(3), -3);
  EXPECT_EQ(got.number(4), -4);
}

// Bits 0..2 = 5, 3..15 = 0x1abc & 0x1fff, little endian: 5 | 0x1abc << 3 = 0xd5e5.
TEST(Fields, BitsArePackedFromTheLeastSignificantOne) {
  Layout layout("integer { size = 3; } a; integer { size = 13; } b;", {"a", "b"});
  const auto got = layout.decode({0xe5, 0xd5});
  EXPECT_EQ(got.number(0), 5);
  EXPECT_EQ(got.number(1), 0x1abc);
}

// 101 1101010111100: 1011 1010 1011 1100.
TEST(Fields, BigEndianBitsArePackedFromTheMostSignificantOne) {
  Layout layout("integer { size = 3; } a; integer { size = 13; signed = 1; } b;", {"a", "b"}, "be");
  const auto got = layout.decode({0xba, 0xbc});
  EXPECT_EQ(got.number(0), 5);
  EXPECT_EQ(got.number(1), 0x1abc - 0x2000);
}

// Whose the bits of a shared byte are would be anybody's guess (CTF 1.8, 4.1.5).
TEST(Fields, AByteOrderThatChangesWithinAByteIsRefused) {
  const std::string little = "integer { size = 4; byte_order = le; } ";
  const std::string big = "integer { size = 4; byte_order = be; } ";
  const auto outcome = [](const std::string& declarations) {
    return Layout(declarations, {"b"}).decode({0x12, 0x34, 0x56, 0x78, 0x9a, 0xbc}).outcome;
  };
  EXPECT_EQ(outcome(little + "a; " + big + "b;"), Outcome::mixed_order);
  EXPECT_EQ(outcome(big + "a; " + little + "b;"), Outcome::mixed_order);
  EXPECT_EQ(outcome(little + "a; " + big + "c; " + big + "b;"), Outcome::mixed_order);
  EXPECT_EQ(outcome(little + "a[1]; " + big + "b[1];"), Outcome::mixed_order);
  EXPECT_EQ(outcome(little + "a; struct { " + big + "x; } s[1]; " + little + "b;"),
            Outcome::mixed_order);
  EXPECT_EQ(outcome(little + "a; floating_point { exp_dig = 8; mant_dig = 24; align = 1; "
                             "byte_order = be; } c; u8 b;"),
            Outcome::mixed_order);
  // Each byte has one.
  EXPECT_EQ(outcome(little + "a; " + little + "c; " + big + "d; " + big + "b;"), Outcome::ok);
  EXPECT_EQ(outcome(little + "a; integer { size = 16; align = 8; byte_order = be; } c; u8 b;"),
            Outcome::ok);
  EXPECT_EQ(outcome(little + "a; " + big + "c[0]; " + little + "b;"), Outcome::ok);
}

TEST(Fields, AlignmentSkipsBits) {
  Layout layout(
      "integer { size = 4; } a; u8 b; integer { size = 8; align = 32; } c; "
      "integer { size = 64; align = 64; } d;",
      {"a", "b", "c", "d"});
  Bytes bytes(16, 0);
  bytes[0] = 0x0f;
  bytes[1] = 7;
  bytes[4] = 9;
  bytes[8] = 11;
  const auto got = layout.decode(bytes);
  EXPECT_EQ(got.number(0), 15);
  EXPECT_EQ(got.number(1), 7);
  EXPECT_EQ(got.number(2), 9);
  EXPECT_EQ(got.number(3), 11);
  EXPECT_EQ(got.end, 128U);
}

TEST(Fields, RealsStringsAndStructuresAreSteppedOver) {
  Layout layout(
      "floating_point { exp_dig = 8; mant_dig = 24; align = 32; } f; string s; "
      "struct { u8 x; string y; } n; floating_point { exp_dig = 11; mant_dig = 53; } d; u8 z;",
      {"f", "s", "n", "z"});
  const auto got = layout.decode({0, 0, 0, 0, 'h', 'i', 0, 1, 'y', 0, 0, 0, 0, 0, 0, 0, 0, 0, 42});
  EXPECT_EQ(got.outcome, Outcome::ok);
  EXPECT_EQ(got.fields[0].kind, Field::Kind::absent);
  EXPECT_EQ(got.text(1), "hi");
  EXPECT_EQ(got.fields[2].kind, Field::Kind::absent);
  EXPECT_EQ(got.number(3), 42);
}

TEST(Fields, CharactersAreATextUpToTheirNul) {
  Layout layout(
      "integer { size = 8; encoding = UTF8; } a[4]; u8 n; "
      "integer { size = 8; encoding = ASCII; } b[n];",
      {"a", "b"});
  const auto got = layout.decode({'a', 'b', 0, 'x', 2, 'c', 'd'});
  EXPECT_EQ(got.text(0), "ab");
  EXPECT_EQ(got.text(1), "cd");
}

TEST(Fields, ArraysAndSequencesOfIntegers) {
  Layout layout("u8 n; u16 s[n]; integer { size = 4; } a[4]; u8 z;", {"n", "s", "a", "z"});
  const auto got = layout.decode({2, 0x01, 0x02, 0x03, 0x04, 0x21, 0x43, 9});
  EXPECT_EQ(got.integers(2), (std::vector<std::uint32_t>{1, 2, 3, 4}));
  EXPECT_EQ(got.number(3), 9);
}

TEST(Fields, ASequenceAskedForLast) {
  Layout layout("u8 n; u16 s[n];", {"s"});
  EXPECT_EQ(layout.decode({2, 0x01, 0x02, 0x03, 0x04}).integers(0),
            (std::vector<std::uint32_t>{0x0201, 0x0403}));
  EXPECT_EQ(layout.decode({0}).integers(0), std::vector<std::uint32_t>{});
}

TEST(Fields, ElementsWithGapsBetweenThem) {
  Layout layout("integer { size = 8; align = 32; } s[2]; u8 z;", {"s", "z"});
  const auto got = layout.decode({5, 0, 0, 0, 6, 7});
  EXPECT_EQ(got.integers(0), (std::vector<std::uint32_t>{5, 6}));
  EXPECT_EQ(got.number(1), 7);
  Layout bits("integer { size = 3; align = 4; } s[3]; integer { size = 5; } z;", {"s", "z"});
  const auto packed = bits.decode({0x21, 0x8b});  // 1 at 0, 2 at 4, 3 at 8; 0x11 from bit 11 on
  EXPECT_EQ(packed.integers(0), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(packed.number(1), 0x11);
}

TEST(Fields, ElementsWithLengthsOfTheirOwn) {
  Layout layout("u8 n; struct { u8 m; u8 s[m]; } e[n]; u8 z;", {"z"});
  const auto got = layout.decode({2, 3, 1, 1, 1, 0, 77});
  EXPECT_EQ(got.outcome, Outcome::ok);
  EXPECT_EQ(got.number(0), 77);
}

TEST(Fields, VariantByLabelOfItsTag) {
  Layout layout(
      "enum : integer { size = 8; signed = 1; } { small = -2 ... -1, big = 5, text = 6 } tag; "
      "variant <tag> { u8 small; integer { size = 32; } big; string text; } v; u8 z;",
      {"tag", "z"});
  EXPECT_EQ(layout.decode({0xff, 1, 9}).number(1), 9);
  EXPECT_EQ(layout.decode({5, 1, 1, 1, 1, 9}).number(1), 9);
  EXPECT_EQ(layout.decode({6, 'a', 'b', 0, 9}).number(1), 9);
  EXPECT_EQ(layout.decode({7, 1, 9}).outcome, Outcome::no_option);
}

TEST(Fields, LabelsOfEnumerationsAndNumbersOfIntegers) {
  constexpr std::array<std::string_view, 2> kWanted{"ok", "exception"};
  const FieldRequest request("status", kWanted);
  Layout by_label("enum : u8 { exception = 3, other = 4, ok = 200 ... 255 } status;", {request});
  EXPECT_EQ(by_label.decode({3}).fields[0].label, 1);
  EXPECT_EQ(by_label.decode({4}).fields[0].label, -1);
  EXPECT_EQ(by_label.decode({5}).fields[0].label, -1);
  EXPECT_EQ(by_label.decode({201}).fields[0].label, 0);
  Layout wide("enum : integer { size = 32; signed = 1; } { ok = -5, exception = 1000 } status;",
              {request});
  EXPECT_EQ(wide.decode({0xfb, 0xff, 0xff, 0xff}).fields[0].label, 0);
  EXPECT_EQ(wide.decode({0xe8, 0x03, 0, 0}).fields[0].label, 1);
  Layout by_number("u8 status;", {request});
  EXPECT_EQ(by_number.decode({1}).fields[0].label, 1);
  EXPECT_EQ(by_number.decode({2}).fields[0].label, -1);
}

TEST(Fields, UnderscoreAndAlternatives) {
  Layout layout("u8 _pid; u8 tid;", {"prev_tid|tid", "vpid|pid"});
  const auto got = layout.decode({3, 4});
  EXPECT_EQ(got.number(0), 4);
  EXPECT_EQ(got.number(1), 3);
}

TEST(Fields, DataThatEndIsCutNotRead) {
  Layout integers("u8 a; integer { size = 64; } b;", {"a"});
  EXPECT_EQ(integers.decode({1, 2, 3}).outcome, Outcome::cut);
  Layout text("string s;", {"s"});
  EXPECT_EQ(text.decode({'a', 'b'}).outcome, Outcome::cut);
  Layout sequence("integer { size = 64; } n; u16 s[n];", {"s"});
  EXPECT_EQ(sequence.decode({0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1}).outcome,
            Outcome::cut);
  Layout bits("integer { size = 7; } a; integer { size = 7; } b;", {"b"});
  EXPECT_EQ(bits.decode({1}).outcome, Outcome::cut);
}

TEST(Fields, EndlessWorkOnNothingIsRefused) {
  Layout layout("integer { size = 64; } n; u8 m; struct { u8 s[event.fields.m]; } e[n];", {"n"});
  EXPECT_EQ(layout.decode({0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f, 0}).outcome,
            Outcome::too_complex);
}

}  // namespace
}  // namespace cie::analysis::ctf
